// Simple polygons with holes.
//
// Invariant of a Polygon made by Make, which is OGC validity: every ring has at least three
// distinct vertices within 1e9 m of the origin, no ring crosses or touches itself, two rings touch
// in single points at most, holes lie inside the outer ring and leave the interior in one piece.
// The outer ring runs counter-clockwise and holes clockwise, and no ring repeats its first vertex
// at the end. Vertices keep their order (up to reversal), the first one its place, and all their
// exact coordinates. A Polygon is a value: immutable, safe to read from many threads.
#ifndef HYPERMAP_MAP_GEOMETRY_POLYGON_H_
#define HYPERMAP_MAP_GEOMETRY_POLYGON_H_

#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "map/geometry/point.h"

namespace hypermap {

// Vertices of a closed ring in order; the closing vertex is not repeated.
using Ring = std::vector<Point>;
// The outer ring first, then the holes, of which there are seldom any.
using Rings = absl::InlinedVector<Ring, 1>;

class Polygon {
 public:
  // The empty polygon: no rings, covers nothing.
  Polygon() = default;

  // Validates and normalises. Accepts closed or open rings of either winding and drops directly
  // repeated vertices. INVALID_ARGUMENT names the ring and the vertex (0-based, as given) or the
  // place of the crossing.
  static absl::StatusOr<Polygon> Make(Ring outer, std::vector<Ring> holes = {});

  // For rings already known to satisfy the invariant (read back from a store, moved rigidly).
  static Polygon MakeUnchecked(Rings rings);

  // The closed rectangle of `box`, which must have an area.
  static Polygon FromBox(const Box& box);

  bool empty() const { return rings_.empty(); }
  // The outer ring first, then the holes.
  const Rings& rings() const { return rings_; }
  // Not of the empty polygon.
  const Ring& outer() const { return rings_.front(); }
  const Box& bounds() const { return bounds_; }
  int num_vertices() const;

  friend bool operator==(const Polygon& a, const Polygon& b) { return a.rings_ == b.rings_; }

 private:
  explicit Polygon(Rings rings);

  Rings rings_;
  Box bounds_;
};

// Area in square metres (holes taken out) and centre of area; 0 and the origin for the empty
// polygon.
double Area(const Polygon& polygon);
Point Centroid(const Polygon& polygon);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_POLYGON_H_
