// Overlap of polygons.
#ifndef HYPERMAP_MAP_GEOMETRY_OVERLAP_H_
#define HYPERMAP_MAP_GEOMETRY_OVERLAP_H_

#include "map/geometry/polygon.h"

namespace hypermap {

// Area of the intersection in square metres; 0 if one is empty or they only touch. Two convex
// polygons, the usual footprints, are clipped without GEOS, in time proportional to the product of
// their numbers of vertices.
double IntersectionArea(const Polygon& a, const Polygon& b);

// Intersection over union (the Jaccard index), in [0, 1]; 0 if one is empty.
double Iou(const Polygon& a, const Polygon& b);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_OVERLAP_H_
