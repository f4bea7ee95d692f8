// The most likely poses on the plane, given claims, the motions between them, and walls.
#ifndef HYPERMAP_MAP_SMOOTHING_POSE_GRAPH_H_
#define HYPERMAP_MAP_SMOOTHING_POSE_GRAPH_H_

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "map/smoothing/grid_walls.h"
#include "map/smoothing/planar_pose.h"

namespace hypermap::smoothing {

// A pose that a localisation claims. Its error is a bias, which changes slowly over a series of
// claims (a first-order Gauss-Markov process), and independent jitter: the next claims mostly
// repeat the error of this one.
struct Claim {
  double time_s = 0.0;
  int series = 0;  // Claims of one series, such as those of a robot, share their bias.
  PlanarPose pose;
  Eigen::Matrix3d covariance;  // Of bias and jitter together; positive definite.
};

// The motion from one pose to another, in the axes of the first one.
struct Motion {
  int from = 0;
  int to = 0;
  PlanarPose motion;
  Eigen::Matrix3d information;
};

// A piece of an upright surface, in the view of a pose.
struct WallPiece {
  Eigen::Vector2d position;
  Eigen::Vector2d normal;  // Towards the camera; of length 1.
  double weight = 1.0;     // As a share of an independent measurement.
};

struct PoseGraph {
  std::vector<Claim> claims;  // One for each pose, ascending by time in each series.
  std::vector<Motion> motions;
  std::vector<std::vector<WallPiece>> walls;  // Of each pose.
};

// Returns the poses that minimise the sum of squares, by Gauss-Newton from `start` on. Residuals of
// motions and walls are weighted by Geman-McClure kernels; that of walls is `wall_kernel_m`.
// `walls` may be null. By how much surfaces lie in front of the centres of a grid's cells depends
// on who made the grid: it is estimated, too. CANCELLED if the work of this thread is cancelled.
absl::StatusOr<std::vector<PlanarPose>> Solve(const PoseGraph& graph, std::vector<PlanarPose> start,
                                              const GridWalls* walls, double wall_kernel_m);

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_POSE_GRAPH_H_
