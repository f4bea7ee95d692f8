// Random content for tests against oracles. All draws come from the generator given, so that a seed
// printed by a failing test repeats it.
#ifndef HYPERMAP_TESTS_SUPPORT_RANDOM_MAP_H_
#define HYPERMAP_TESTS_SUPPORT_RANDOM_MAP_H_

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "map/edits/edit.h"
#include "map/snapshot.h"

namespace hypermap::testing {

using Rng = std::mt19937_64;

// A seed from $HYPERMAP_TEST_SEED, else a fresh one. Print it with SCOPED_TRACE.
uint64_t TestSeed();

double Uniform(Rng& rng, double low, double high);
int UniformInt(Rng& rng, int low, int high);  // both ends included

// A valid star-shaped polygon of 3 to 12 vertices round `centre`, sometimes with a hole. When
// `snap_m` is positive the vertices lie on multiples of it, so that boundaries meet cell centres
// and edges.
Polygon RandomPolygon(Rng& rng, const Point& centre, double radius_m, double snap_m = 0.0);

// A polygon, a line string of 2 to 8 vertices or a point, each about as often.
Shape RandomShape(Rng& rng, const Point& centre, double radius_m);

// Any of the shape's vertices.
Point RandomVertex(Rng& rng, const Shape& shape);

// A label out of a few, a random shape, sometimes with classes, tags, attributes and heights.
SemanticObject RandomObject(Rng& rng, const Point& centre, double radius_m);

PlanarTransform RandomTransform(Rng& rng, double range_m);

// Cells of a box with values that the kind can hold, in patches, some unknown.
std::vector<std::optional<double>> RandomCells(Rng& rng, LayerKind kind, const CellBox& box);

// Edits that make one layer of each kind with content around the origin, in frames of their own,
// one of them connected to nothing.
EditBatch RandomSite(Rng& rng, int num_objects);

// A few edits of the content of `site`, which is one that came of RandomSite: objects put, moved
// and removed, cells, aliases; now and then a frame moved, or a layer that goes or comes.
EditBatch RandomEdits(Rng& rng, const Snapshot& site);

// The snapshot of a new map called `name` after `batch`; fails the test when it can't be applied.
Snapshot MakeSnapshot(const std::string& name, const EditBatch& batch);

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_RANDOM_MAP_H_
