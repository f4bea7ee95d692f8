#include "client_libs/ros2/conversion/rigid_transform.h"

#include <cmath>

#include "absl/status/status.h"

namespace hypermap::ros2 {
namespace {

constexpr double kMaxLengthError = 0.01;

}  // namespace

RigidTransform RigidTransform::Inverse() const {
  const Eigen::Quaterniond inverse = rotation.conjugate();
  return {-(inverse * translation), inverse};
}

RigidTransform operator*(const RigidTransform& a, const RigidTransform& b) {
  return {a.translation + a.rotation * b.translation, a.rotation * b.rotation};
}

RigidTransform Interpolate(const RigidTransform& begin, const RigidTransform& end, double share) {
  return {begin.translation + share * (end.translation - begin.translation),
          begin.rotation.slerp(share, end.rotation)};
}

absl::StatusOr<RigidTransform> ToRigidTransform(const geometry_msgs::Transform& message) {
  const geometry_msgs::Vector3& t = message.translation;
  const geometry_msgs::Quaternion& q = message.rotation;
  RigidTransform transform{{t.x, t.y, t.z}, {q.w, q.x, q.y, q.z}};
  const double length = transform.rotation.norm();
  // The comparison is false for a NaN, too.
  if (!transform.translation.allFinite() || !(std::abs(length - 1.0) <= kMaxLengthError)) {
    return absl::InvalidArgumentError("a transform is not rigid, or not finite");
  }
  transform.rotation.coeffs() /= length;
  return transform;
}

int64_t Nanoseconds(const builtin_interfaces::Time& stamp) {
  return int64_t{stamp.sec} * 1'000'000'000 + stamp.nanosec;
}

absl::Time FromStamp(const builtin_interfaces::Time& stamp) {
  return absl::FromUnixNanos(Nanoseconds(stamp));
}

}  // namespace hypermap::ros2
