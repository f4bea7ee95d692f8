// Refines the pose of a frame by matching the walls in it to an occupancy grid.
#ifndef HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_
#define HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_

#include <Eigen/Core>

#include "ingest/perception/organised_cloud.h"
#include "map/grid/distance_field.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ingest {

// The motion (x, y in metres, yaw in radians, about the cloud's foot) from the claimed pose of a
// frame to the most likely one, and the covariance of the corrected pose.
struct PoseCorrection {
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// Immutable; safe to use from many threads. Each frame is matched on its own, so that it always
// gives the same correction, whoever sends it and when.
class WallMatcher {
 public:
  // Copies the occupied cells of `occupancy`, whose frame must be that of the poses. Linear in the
  // cells of the layer's extent.
  explicit WallMatcher(const GridLayer& occupancy);

  // Returns the most likely motion, given the walls in `cloud` and a prior of mean 0 and covariance
  // `prior`: damped Gauss-Newton on the distances to the nearest occupied cell, with Geman-McClure
  // weights, so that furniture that is not in the grid counts little. Returns no motion and `prior`
  // itself if too few walls are seen, `prior` is not positive definite, or the pose is known better
  // than the grid can tell it: standard deviations of at most a fifth of a cell and 5 mrad.
  PoseCorrection Match(const OrganisedCloud& cloud, const Eigen::Matrix3d& prior) const;

 private:
  double resolution_m_;
  DistanceField distance_;  // To the occupied cells of the grid, in the layer's frame.
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_
