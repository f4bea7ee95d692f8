// What a frame has seen of the plane.
#ifndef HYPERMAP_INGEST_PERCEPTION_VISIBILITY_H_
#define HYPERMAP_INGEST_PERCEPTION_VISIBILITY_H_

#include <vector>

#include "ingest/perception/organised_cloud.h"
#include "map/geometry/polygon.h"
#include "map/observations/observation.h"

namespace hypermap::ingest {

struct VisibilityOptions {
  // Returns between these heights above the plane stand in the way, metres.
  float obstacle_low_m = 0.1f;
  float obstacle_high_m = 1.8f;
  float max_range_m = 8.0f;
  int bearings = 96;
};

// The convex hull of all points seen, on the plane: the paper's visible area (Zaenker et al. 2020,
// section IV-B). Holds places that are hidden. Empty without returns.
Polygon ViewHull(const OrganisedCloud& cloud, const VisibilityOptions& options);

// The part of the plane that was seen to be free: for each bearing from the nearest floor in the
// image to the first thing that stands in the way, or to the farthest floor seen. The largest
// connected run of bearings; empty when there is none.
Polygon FreeSpace(const OrganisedCloud& cloud, const VisibilityOptions& options);

// Depth along every `stride`-th pixel's ray, were the camera not distorted; masks[i] is that of the
// i-th detection.
DepthView ThinnedDepth(const OrganisedCloud& cloud, const CameraModel& camera, int stride,
                       const std::vector<const std::vector<uint8_t>*>& masks);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_VISIBILITY_H_
