// Convex hulls in the plane.
#ifndef HYPERMAP_MAP_GEOMETRY_CONVEX_HULL_H_
#define HYPERMAP_MAP_GEOMETRY_CONVEX_HULL_H_

#include <vector>

#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap {

// Returns the smallest convex polygon that covers all `points`. Exact, with the fewest vertices:
// points on an edge are not vertices. The first vertex is the one with the least x (then y).
// Ignores points that are not finite. Empty if fewer than three points are left or all of them are
// on one line.
Polygon ConvexHull(std::vector<Point> points);

// Returns the area that represents `shape` in comparisons of areas: the polygon itself; for other
// shapes, the convex hull of the squares with sides 2 * half_width_m around the vertices.
Polygon FootprintOf(const Shape& shape, double half_width_m);

// Returns whether `polygon` has no hole and turns left, or goes straight on, at every vertex.
bool IsConvex(const Polygon& polygon);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_CONVEX_HULL_H_
