#include "map/registration/transform_estimate.h"

#include <Eigen/Geometry>
#include <utility>

#include "map/geometry/point.h"

namespace hypermap::registration {

absl::string_view AmbiguityName(Ambiguity ambiguity) {
  switch (ambiguity) {
    case Ambiguity::kNone:
      return "none";
    case Ambiguity::kLittleAgreement:
      return "little_agreement";
    case Ambiguity::kRunnerUp:
      return "runner_up";
    case Ambiguity::kFreeDirection:
      return "free_direction";
  }
  return "none";
}

TransformEstimate InFrames(TransformEstimate estimate,
                           const PlanarTransform& new_target_from_target,
                           const PlanarTransform& new_source_from_source) {
  const PlanarTransform source_from_new_source = new_source_from_source.Inverse();
  if (estimate.covariance.allFinite()) {
    const PlanarTransform& before = estimate.best.target_from_source;
    // The old origin of the source is the point of which the covariance is known.
    const Point new_origin = before * (source_from_new_source * Point{0.0, 0.0});
    const Eigen::Vector2d lever(before.x() - new_origin.x, before.y() - new_origin.y);
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() =
        Eigen::Rotation2Dd(new_target_from_target.yaw()).toRotationMatrix();
    estimate.covariance =
        turn * CovarianceOfTransform(estimate.covariance, lever) * turn.transpose();
  }
  const auto move = [&](Mode* mode) {
    mode->target_from_source =
        new_target_from_target * mode->target_from_source * source_from_new_source;
  };
  move(&estimate.best);
  if (estimate.runner_up) move(&*estimate.runner_up);
  return estimate;
}

Eigen::Matrix3d CovarianceOfTransform(const Eigen::Matrix3d& of_point,
                                      const Eigen::Vector2d& lever) {
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
  jacobian(0, 2) = lever.y();
  jacobian(1, 2) = -lever.x();
  const Eigen::Matrix3d covariance = jacobian * of_point * jacobian.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace hypermap::registration
