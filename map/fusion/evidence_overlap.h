// Measures of overlap between two things: of their outlines, and of their ranges of heights.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_OVERLAP_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_OVERLAP_H_

#include "map/geometry/polygon.h"
#include "map/objects/semantic_object.h"

namespace hypermap::fusion {

// Shares in [0, 1]; both are 0 if the outlines have no area in common.
struct OutlineOverlap {
  double iou = 0.0;        // Intersection over union (the Jaccard index).
  double contained = 0.0;  // Share of the smaller outline inside the other.
};

// For convex outlines, costs the product of their numbers of vertices.
OutlineOverlap OverlapOf(const Polygon& a, const Polygon& b);

// Returns the share of the shorter range of heights that both have in common, in [0, 1]. Ranges
// shorter than `min_range_m` (> 0) are first widened to this on both sides.
double HeightOverlap(HeightRange a, HeightRange b, double min_range_m);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_OVERLAP_H_
