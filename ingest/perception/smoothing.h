// Depth noise taken off the points of a thing.
#ifndef HYPERMAP_INGEST_PERCEPTION_SMOOTHING_H_
#define HYPERMAP_INGEST_PERCEPTION_SMOOTHING_H_

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "ingest/perception/organised_cloud.h"

namespace hypermap::ingest {

// The points of those `pixels` (ascending, with depth) that lie in every `stride`-th row and column
// of the image, each moved along its ray to the mean depth of those of all `pixels` that are at
// most two away from it and on the same surface. Along the axes of the frame of the pose, from the
// camera, metres.
std::vector<Eigen::Vector3f> SmoothedFromCamera(const OrganisedCloud& cloud,
                                                const std::vector<int32_t>& pixels, int stride);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_SMOOTHING_H_
