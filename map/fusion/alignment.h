// The small rigid motion that makes a frame's detections agree with the objects they are of.
#ifndef HYPERMAP_MAP_FUSION_ALIGNMENT_H_
#define HYPERMAP_MAP_FUSION_ALIGNMENT_H_

#include <Eigen/Core>
#include <vector>

#include "map/fusion/shape_grid.h"
#include "map/fusion/track.h"

namespace hypermap::fusion {

// A detection's cells beside the track it is likely of.
struct AlignmentPair {
  std::vector<Point> cells;  // centres, layer frame
  const Track* track = nullptr;
  double weight = 1.0;
};

// Motion (x, y, yaw about `pivot`) with the greatest sum over the pairs of
//   weight * gain * (mean occupancy of the track under the moved cells)
// less half the squared Mahalanobis distance of the motion under `prior`; found by pattern search
// from zero.
Eigen::Vector3d Align(const std::vector<AlignmentPair>& pairs, const Point& pivot,
                      const Eigen::Matrix3d& prior, const EvidenceParameters& parameters);

// `p` turned by motion.z() about `pivot`, then moved.
Point Apply(const Eigen::Vector3d& motion, const Point& pivot, const Point& p);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_ALIGNMENT_H_
