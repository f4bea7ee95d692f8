// Convex hulls on the plane.
#ifndef HYPERMAP_MAP_GEOMETRY_CONVEX_HULL_H_
#define HYPERMAP_MAP_GEOMETRY_CONVEX_HULL_H_

#include <vector>

#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap {

// The smallest convex polygon that covers all `points`, with the fewest vertices: exact, those on
// an edge are no vertices. The vertex with the least x (then y) comes first. Empty when the finite
// points are fewer than three or lie on one line; points that are not finite are left out.
Polygon ConvexHull(std::vector<Point> points);

// An area that stands for `shape` where only areas can be compared: a polygon itself; of other
// shapes the convex hull of what lies within `half_width_m` of a vertex along either axis.
Polygon FootprintOf(const Shape& shape, double half_width_m);

// Whether `polygon` has no hole and every vertex turns left or goes straight on.
bool IsConvex(const Polygon& polygon);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_CONVEX_HULL_H_
