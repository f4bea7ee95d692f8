#include "map/registration/transform_estimate.h"

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

Eigen::Matrix3d CovarianceOfTransform(const Eigen::Matrix3d& of_point,
                                      const Eigen::Vector2d& lever) {
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
  jacobian(0, 2) = lever.y();
  jacobian(1, 2) = -lever.x();
  const Eigen::Matrix3d covariance = jacobian * of_point * jacobian.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace hypermap::registration
