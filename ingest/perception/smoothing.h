// Smoothing of an object's depth before its footprint is measured.
#ifndef HYPERMAP_INGEST_PERCEPTION_SMOOTHING_H_
#define HYPERMAP_INGEST_PERCEPTION_SMOOTHING_H_

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "ingest/perception/organised_cloud.h"

namespace hypermap::ingest {

// Returns the points of `pixels` (ascending, all with depth) that lie in every `stride`-th row and
// column of the image. Each point is moved along its ray to the mean depth of the `pixels` within
// two rows and columns that lie on the same surface, which reduces depth noise and keeps edges.
// Positions are relative to the camera, along the axes of the pose's frame, in metres.
std::vector<Eigen::Vector3f> SmoothedFromCamera(const OrganisedCloud& cloud,
                                                const std::vector<int32_t>& pixels, int stride);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_SMOOTHING_H_
