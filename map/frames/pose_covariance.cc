#include "map/frames/pose_covariance.h"

#include <Eigen/Geometry>

namespace hypermap {

bool IsPoseCovariance(const Eigen::Matrix3d& covariance) {
  return covariance.allFinite() && (covariance.diagonal().array() >= 0.0).all() &&
         covariance.isApprox(covariance.transpose(), 1e-9);
}

Eigen::Matrix3d TransformedCovariance(const Eigen::Matrix3d& covariance,
                                      const PlanarTransform& target_from_source) {
  // The yaw is the third coordinate, which a rotation about the third axis leaves alone.
  const Eigen::Matrix3d r =
      Eigen::AngleAxisd(target_from_source.yaw(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d turned = r * covariance * r.transpose();
  return 0.5 * (turned + turned.transpose());
}

}  // namespace hypermap
