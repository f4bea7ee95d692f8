// Simple polygons with holes.
//
// Invariant of a Polygon made by Make, which is OGC validity: every ring has at least three
// distinct vertices within 1e9 m of the origin along each axis, no ring crosses or touches itself,
// two rings touch only in single points, and holes are inside the outer ring and leave the interior
// connected. The outer ring is counter-clockwise and holes are clockwise; no ring repeats its first
// vertex at the end. Vertices keep their exact coordinates and their order (up to reversal), and
// the first one stays the first. An immutable value; safe to read from many threads.
#ifndef HYPERMAP_MAP_GEOMETRY_POLYGON_H_
#define HYPERMAP_MAP_GEOMETRY_POLYGON_H_

#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "map/geometry/point.h"

namespace hypermap {

// The vertices of a closed ring in order, without the closing vertex.
using Ring = std::vector<Point>;
// The outer ring, then the holes. Most polygons have none.
using Rings = absl::InlinedVector<Ring, 1>;

class Polygon {
 public:
  // The empty polygon has no rings and covers nothing.
  Polygon() = default;

  // Validates and normalises. Accepts closed and open rings of either winding, and drops vertices
  // that repeat the one before. INVALID_ARGUMENT names the ring and the vertex (0-based, as given),
  // or the rings at fault and the place. O(n log n) for n vertices in all rings, valid or not.
  // Errors of CheckCancelled.
  static absl::StatusOr<Polygon> Make(Ring outer, std::vector<Ring> holes = {});

  // For rings known to satisfy the invariant, such as those read from a store or moved rigidly.
  static Polygon MakeUnchecked(Rings rings);

  // Returns the closed rectangle of `box`, which must have an area.
  static Polygon FromBox(const Box& box);

  bool empty() const { return rings_.empty(); }
  // The outer ring, then the holes.
  const Rings& rings() const { return rings_; }
  // REQUIRES: not empty.
  const Ring& outer() const { return rings_.front(); }
  const Box& bounds() const { return bounds_; }
  int num_vertices() const;

  friend bool operator==(const Polygon& a, const Polygon& b) { return a.rings_ == b.rings_; }

 private:
  explicit Polygon(Rings rings);

  Rings rings_;
  Box bounds_;
};

// Returns whether a ring runs against the winding of a Polygon, by more than the rounding of its
// area explains. The rings of a valid polygon may do so after a motion has rounded their vertices.
bool RunsBackwards(const Rings& rings);

// Area in square metres, without the holes, and centre of area; 0 and the origin for the empty
// polygon.
double Area(const Polygon& polygon);
Point Centroid(const Polygon& polygon);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_POLYGON_H_
