// Convex polygons with a margin.
#ifndef HYPERMAP_MAP_FUSION_WIDENED_POLYGON_H_
#define HYPERMAP_MAP_FUSION_WIDENED_POLYGON_H_

#include "map/geometry/polygon.h"

namespace hypermap::fusion {

// Returns `convex`, which must be convex, widened by `margin_m` on all sides: its Minkowski sum
// with an octagon of this circumradius. Returns it unchanged if it is empty or the margin is not
// positive. Merges the edges of both by direction (de Berg et al. 2008, section 13.3), in time
// linear in the number of vertices.
Polygon Widened(const Polygon& convex, double margin_m);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_WIDENED_POLYGON_H_
