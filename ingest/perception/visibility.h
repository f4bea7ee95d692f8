// The parts of the floor plane, and of space, that a frame has seen.
#ifndef HYPERMAP_INGEST_PERCEPTION_VISIBILITY_H_
#define HYPERMAP_INGEST_PERCEPTION_VISIBILITY_H_

#include <vector>

#include "ingest/perception/organised_cloud.h"
#include "map/geometry/polygon.h"
#include "map/observations/observation.h"

namespace hypermap::ingest {

struct VisibilityOptions {
  // Returns between these heights above the plane are obstacles, metres.
  float obstacle_low_m = 0.1f;
  float obstacle_high_m = 1.8f;
  // Returns beyond this range are ignored, metres.
  float max_range_m = 8.0f;
  // Number of bearings into which the field of view is divided.
  int bearings = 96;
};

// Returns the convex hull of all points seen, projected to the plane: the visible area of Zaenker
// et al. 2020, section IV-B. It contains hidden places, too. Empty without returns.
Polygon ViewHull(const OrganisedCloud& cloud, const VisibilityOptions& options);

// Returns the part of the plane that was seen to be free: on each bearing, from the nearest floor
// in the image to the first obstacle, or to the farthest floor seen. Of several connected runs of
// bearings the widest is returned. Empty if there is none.
Polygon FreeSpace(const OrganisedCloud& cloud, const VisibilityOptions& options);

// Returns the depth image as a camera without distortion would see it, thinned to every `stride`-th
// pixel. masks[i] is the mask of the i-th detection.
DepthView ThinnedDepth(const OrganisedCloud& cloud, const CameraModel& camera, int stride,
                       const std::vector<const std::vector<uint8_t>*>& masks);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_VISIBILITY_H_
