// Exact predicates on points and shapes. Boundaries belong to shapes: a point on an edge is
// covered, and shapes that touch intersect. Coordinates are compared as given, without a tolerance,
// and signs of orientations are exact, so that the answers equal those of GEOS and of every tool
// built on it.
#ifndef HYPERMAP_MAP_GEOMETRY_PREDICATES_H_
#define HYPERMAP_MAP_GEOMETRY_PREDICATES_H_

#include <memory>

#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap {

// Returns the sign of the turn a -> b -> c: 1 left (counter-clockwise), -1 right, 0 on one line.
// Exact.
int Orientation(const Point& a, const Point& b, const Point& c);

// Returns whether `p` is inside `polygon` or on its boundary. Linear in the number of vertices.
bool Covers(const Polygon& polygon, const Point& p);

// Returns whether `p` is on `line`. Linear in the number of vertices.
bool Covers(const LineString& line, const Point& p);
// Returns whether `p` belongs to `shape`. A point covers only itself.
bool Covers(const Shape& shape, const Point& p);

// Returns the distance in metres from `p` to the nearest point of the shape; 0 if covered, infinity
// if the shape is empty.
double Distance(const Polygon& polygon, const Point& p);
double Distance(const LineString& line, const Point& p);
double Distance(const Shape& shape, const Point& p);

// A polygon, indexed for tests against many other shapes. Movable; used by one thread at a time.
class PreparedPolygon {
 public:
  explicit PreparedPolygon(const Polygon& polygon);
  PreparedPolygon(PreparedPolygon&&) noexcept;
  PreparedPolygon& operator=(PreparedPolygon&&) noexcept;
  ~PreparedPolygon();

  // Returns whether the two share at least one point.
  bool Intersects(const Shape& other) const;
  // Returns whether the prepared polygon covers every point of `other`.
  bool Covers(const Shape& other) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_PREDICATES_H_
