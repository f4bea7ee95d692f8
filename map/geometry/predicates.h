// Exact predicates between points and shapes. Boundaries belong to the shape: a point on an edge is
// covered, shapes that touch intersect. Coordinates are compared as they are given (no
// tolerance); orientation signs are exact, so the answers equal those of GEOS and of every tool
// built on it.
#ifndef HYPERMAP_MAP_GEOMETRY_PREDICATES_H_
#define HYPERMAP_MAP_GEOMETRY_PREDICATES_H_

#include <memory>

#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap {

// Sign of the turn a -> b -> c: 1 left (counter-clockwise), -1 right, 0 on one line. Exact.
int Orientation(const Point& a, const Point& b, const Point& c);

// Whether `p` lies inside or on the boundary of `polygon`. Linear in the vertices.
bool Covers(const Polygon& polygon, const Point& p);

// Whether `p` lies on `line`. Linear in the vertices.
bool Covers(const LineString& line, const Point& p);
// Whether `p` belongs to `shape`; a point covers only itself.
bool Covers(const Shape& shape, const Point& p);

// Distance in metres from `p` to the nearest point of the shape; 0 when covered, infinite when it
// is empty.
double Distance(const Polygon& polygon, const Point& p);
double Distance(const LineString& line, const Point& p);
double Distance(const Shape& shape, const Point& p);

// One polygon, indexed to be tested against many others. Movable; one thread at a time.
class PreparedPolygon {
 public:
  explicit PreparedPolygon(const Polygon& polygon);
  PreparedPolygon(PreparedPolygon&&) noexcept;
  PreparedPolygon& operator=(PreparedPolygon&&) noexcept;
  ~PreparedPolygon();

  // Whether the two share at least one point.
  bool Intersects(const Shape& other) const;
  // Whether every point of `other` is covered by the prepared polygon.
  bool Covers(const Shape& other) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_PREDICATES_H_
