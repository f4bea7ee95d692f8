#include "client_libs/ros2/conversion/poses.h"

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "absl/strings/strip.h"
#include "absl/time/time.h"

namespace hypermap::ros2 {
namespace {

// Of (x, y, yaw) in the message's (x, y, z, roll, pitch, yaw).
constexpr std::array<int, 3> kPlanar = {0, 1, 5};

double YawOf(const geometry_msgs::Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
}

}  // namespace

absl::StatusOr<RobotReport> ToReport(const std::string& robot,
                                     const geometry_msgs::PoseWithCovarianceStamped& message) {
  const geometry_msgs::Pose& pose = message.pose.pose;
  if (!IsFinite({pose.position.x, pose.position.y}) || !std::isfinite(YawOf(pose.orientation))) {
    return absl::InvalidArgumentError("the pose is not finite");
  }
  RobotReport report;
  report.robot = robot;
  report.stamp = absl::FromUnixSeconds(message.header.stamp.sec) +
                 absl::Nanoseconds(message.header.stamp.nanosec);
  report.frame_id = std::string(absl::StripPrefix(message.header.frame_id, "/"));
  report.frame_from_robot =
      PlanarTransform(pose.position.x, pose.position.y, YawOf(pose.orientation));
  Eigen::Matrix3d covariance;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      covariance(row, col) = message.pose.covariance[kPlanar[row] * 6 + kPlanar[col]];
    }
  }
  if (!covariance.isZero(0.0)) report.covariance = covariance;
  return report;
}

}  // namespace hypermap::ros2
