// Lays the walls of one occupancy grid over those of another.
#ifndef HYPERMAP_MAP_REGISTRATION_WALL_ALIGNMENT_H_
#define HYPERMAP_MAP_REGISTRATION_WALL_ALIGNMENT_H_

#include <Eigen/Core>
#include <vector>

#include "map/frames/planar_transform.h"
#include "map/registration/wall_map.h"

namespace hypermap::registration {

// How well two grids agree at a pose.
struct WallAgreement {
  double score = 0.0;         // As Mode::score.
  double inlier_share = 0.0;  // As TransformEstimate::inlier_share.
};

// Refines poses, and judges them. Compares the source's walls with the target's and the target's
// with the source's, so that walls that only one of them has count wherever they are. Immutable;
// safe to use from many threads.
class WallAlignment {
 public:
  // Uses at most `most_walls` walls of each grid, evenly spread. The grids must outlive this.
  WallAlignment(const WallMap& source, const WallMap& target, size_t most_walls);

  // Returns the pose near `start` at which the distances of walls to walls are least: damped
  // Gauss-Newton with Geman-McClure weights, whose width shrinks from `kernel_m` to
  // `final_kernel_m`. Breaks off if the work of this thread is cancelled.
  PlanarTransform Refined(const PlanarTransform& start, double kernel_m,
                          double final_kernel_m) const;

  WallAgreement AgreementAt(const PlanarTransform& pose) const;

  // Returns the information (the inverse of the covariance) of the motion (x, y, yaw) of the
  // source's centre in the target at a refined pose.
  Eigen::Matrix3d InformationAt(const PlanarTransform& pose) const;

  // Returns the root mean square distance between the walls of the source at two poses.
  double Distance(const PlanarTransform& a, const PlanarTransform& b) const;

 private:
  struct Pose {
    Eigen::Vector2d centre;  // Of the source, in the target.
    double yaw;
  };
  struct Normal {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };

  Pose PoseOf(const PlanarTransform& transform) const;
  PlanarTransform TransformOf(const Pose& pose) const;
  // The normal equations of Gauss-Newton.
  Normal NormalAt(const Pose& pose, double kernel_m) const;

  const WallMap& source_;
  const WallMap& target_;
  std::vector<Eigen::Vector2d> source_walls_;  // Relative to the source's centre.
  std::vector<Eigen::Vector2d> target_walls_;
  // Length in metres of the wall for which each of them stands.
  double source_wall_m_;
  double target_wall_m_;
};

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_WALL_ALIGNMENT_H_
