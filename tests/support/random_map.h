// Random content for tests with oracles. All random numbers come from the given generator, so that
// the seed that a failing test prints reproduces it.
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

// Returns the seed in $HYPERMAP_TEST_SEED, otherwise a new one. Print it with SCOPED_TRACE.
uint64_t TestSeed();

double Uniform(Rng& rng, double low, double high);
int UniformInt(Rng& rng, int low, int high);  // both ends included

// Returns a valid star-shaped polygon of 3 to 12 vertices around `centre`, sometimes with a hole.
// If `snap_m` is positive, vertices lie on its multiples, so that boundaries meet centres and edges
// of cells.
Polygon RandomPolygon(Rng& rng, const Point& centre, double radius_m, double snap_m = 0.0);

// Returns a polygon, a line string of 2 to 8 vertices, or a point, with about equal probability.
Shape RandomShape(Rng& rng, const Point& centre, double radius_m);

// Returns a random vertex of the shape.
Point RandomVertex(Rng& rng, const Shape& shape);

// Returns an object with one of a few labels and a random shape, sometimes with classes, tags,
// attributes and heights.
SemanticObject RandomObject(Rng& rng, const Point& centre, double radius_m);

PlanarTransform RandomTransform(Rng& rng, double range_m);

// Returns values for the cells of a box, of a range that the kind can store, in patches, some of
// them unknown.
std::vector<std::optional<double>> RandomCells(Rng& rng, LayerKind kind, const CellBox& box);

// Returns edits that create a layer of each kind with content around the origin, in several frames,
// one of which is not connected to the others.
EditBatch RandomSite(Rng& rng, int num_objects);

// Returns a few edits of `site`, which must come from RandomSite: put, moved and removed objects,
// cells, aliases, sometimes a moved frame, or a created or deleted layer.
EditBatch RandomEdits(Rng& rng, const Snapshot& site);

// Returns the snapshot of a new map called `name` after `batch`. Fails the test if the batch can't
// be applied.
Snapshot MakeSnapshot(const std::string& name, const EditBatch& batch);

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_RANDOM_MAP_H_
