// Where a frame's walls lie on the occupancy grid: an absolute reference for its pose.
#ifndef HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_
#define HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_

#include <Eigen/Core>
#include <vector>

#include "ingest/perception/organised_cloud.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ingest {

// The motion (x, y in metres, yaw in radians, about the cloud's foot) that takes a frame from the
// pose it claims to where it more likely is, and the covariance that is left.
struct PoseCorrection {
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// Immutable; safe to use from many threads. Matching looks at one frame alone, so the same frame
// gives the same correction whoever sends it, and when.
class WallMatcher {
 public:
  // Of the occupied cells of `occupancy`, which is in the frame of the poses.
  explicit WallMatcher(const GridLayer& occupancy);

  // The most likely motion given the walls seen and a prior of mean 0 and covariance `prior`:
  // damped Gauss-Newton on distances to the nearest occupied cell with Geman-McClure weights, so
  // that what the grid doesn't know of (furniture) counts little. The prior's own when no walls are
  // seen, or `prior` is not positive definite.
  PoseCorrection Match(const OrganisedCloud& cloud, const Eigen::Matrix3d& prior) const;

 private:
  // Distance in metres to the nearest occupied cell's centre, at most kReach_m, and its gradient,
  // bilinear between the cells' centres.
  struct Sample {
    double distance = 0.0;
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };
  Sample At(const Eigen::Vector2d& position) const;

  GridGeometry geometry_;
  CellBox box_;
  std::vector<float> distance_m_;  // row-major over box_
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_WALL_MATCHER_H_
