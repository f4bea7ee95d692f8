// The uncertainty of poses in the plane: covariances of (x, y, yaw), metres and radians.
#ifndef HYPERMAP_MAP_FRAMES_POSE_COVARIANCE_H_
#define HYPERMAP_MAP_FRAMES_POSE_COVARIANCE_H_

#include <Eigen/Core>

#include "map/frames/planar_transform.h"

namespace hypermap {

// Returns whether the matrix is finite and symmetric, without negative variances.
bool IsPoseCovariance(const Eigen::Matrix3d& covariance);

// Returns the covariance of target_from_source * pose, given that of a pose in `source`. Symmetric.
Eigen::Matrix3d TransformedCovariance(const Eigen::Matrix3d& covariance,
                                      const PlanarTransform& target_from_source);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FRAMES_POSE_COVARIANCE_H_
