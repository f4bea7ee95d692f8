// Aligns a frame with the map: finds the small rigid motion for which its detections agree best
// with the tracks that they belong to.
#ifndef HYPERMAP_MAP_FUSION_ALIGNMENT_H_
#define HYPERMAP_MAP_FUSION_ALIGNMENT_H_

#include <Eigen/Core>
#include <vector>

#include "map/fusion/shape_grid.h"
#include "map/fusion/track.h"

namespace hypermap::fusion {

// The cells of a detection and the track that it probably belongs to.
struct AlignmentPair {
  std::vector<Point> cells;  // Centres of cells, in the layer's frame.
  const Track* track = nullptr;
  double weight = 1.0;
};

// Returns the motion (x, y, yaw about `pivot`) that maximises the sum over the pairs of
//   weight * gain * (mean occupancy of the track under the moved cells)
// minus half the squared Mahalanobis distance of the motion under the covariance `prior`.
// Compass search from zero motion, with steps from 4 cm (10 mrad) down to 5 mm (1.25 mrad): the
// result is a local maximum.
Eigen::Vector3d Align(const std::vector<AlignmentPair>& pairs, const Point& pivot,
                      const Eigen::Matrix3d& prior, const EvidenceParameters& parameters);

// Returns `p` rotated by motion.z() about `pivot` and then translated.
Point Apply(const Eigen::Vector3d& motion, const Point& pivot, const Point& p);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_ALIGNMENT_H_
