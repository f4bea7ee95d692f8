// Refines the pose of a frame by matching the walls in it to an occupancy grid.
#ifndef HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_
#define HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_

#include <Eigen/Core>
#include <vector>

#include "ingest/perception/organised_cloud.h"
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
  // itself if too few walls are seen or `prior` is not positive definite.
  PoseCorrection Match(const OrganisedCloud& cloud, const Eigen::Matrix3d& prior) const;

 private:
  // Distance in metres to the centre of the nearest occupied cell, at most kReach_m, and its
  // gradient along the axes of the layer's frame. Interpolated bilinearly between cell centres,
  // since Gauss-Newton needs a continuous distance.
  struct Sample {
    double distance = 0.0;
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };
  Sample At(const Eigen::Vector2d& position) const;

  GridGeometry geometry_;
  CellBox box_;
  std::vector<float> distance_m_;  // Distance transform, row-major over box_.
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_
