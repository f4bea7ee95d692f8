// Rigid motions of space, as tf has them.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_RIGID_TRANSFORM_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_RIGID_TRANSFORM_H_

#include <Eigen/Geometry>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {

// A rotation followed by a translation in metres. Variables are named target_from_source, as
// PlanarTransform has it. The length of `rotation` is 1.
struct RigidTransform {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  RigidTransform Inverse() const;
  friend RigidTransform operator*(const RigidTransform& a, const RigidTransform& b);
};

// The transform at `share` of the way from `begin` (0) to `end` (1): translation linear, rotation
// by slerp, the shorter way round (Shoemake 1985).
RigidTransform Interpolate(const RigidTransform& begin, const RigidTransform& end, double share);

// INVALID_ARGUMENT if a number is not finite, or the quaternion's length differs from 1 by more
// than 1 %; a smaller difference is rounding.
absl::StatusOr<RigidTransform> ToRigidTransform(const geometry_msgs::Transform& message);

// Since 1970, by the clock of the one who sent it.
int64_t Nanoseconds(const builtin_interfaces::Time& stamp);
absl::Time FromStamp(const builtin_interfaces::Time& stamp);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_RIGID_TRANSFORM_H_
