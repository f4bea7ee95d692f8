#include "client_libs/ros2/conversion/poses.h"

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "absl/strings/strip.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

// Of (x, y, yaw) in the message's (x, y, z, roll, pitch, yaw).
constexpr std::array<int, 3> kPlanar = {0, 1, 5};

double YawOf(const Eigen::Quaterniond& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()),
                    1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

}  // namespace

absl::StatusOr<RobotReport> ToReport(const std::string& robot,
                                     const geometry_msgs::PoseWithCovarianceStamped& message) {
  const auto& [position, orientation] = message.pose.pose;
  HYPERMAP_ASSIGN_OR_RETURN(
      RobotReport report, ToReport(robot, FromStamp(message.header.stamp),
                                   std::string(absl::StripPrefix(message.header.frame_id, "/")),
                                   {{position.x, position.y, position.z},
                                    {orientation.w, orientation.x, orientation.y, orientation.z}}));
  Eigen::Matrix3d covariance;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      covariance(row, col) = message.pose.covariance[kPlanar[row] * 6 + kPlanar[col]];
    }
  }
  if (!covariance.isZero(0.0)) report.covariance = covariance;
  return report;
}

absl::StatusOr<RobotReport> ToReport(const std::string& robot, absl::Time stamp,
                                     const std::string& frame_id,
                                     const RigidTransform& frame_from_robot) {
  const double x = frame_from_robot.translation.x();
  const double y = frame_from_robot.translation.y();
  const double yaw = YawOf(frame_from_robot.rotation);
  if (!IsFinite({x, y}) || !std::isfinite(yaw)) {
    return absl::InvalidArgumentError("the pose is not finite");
  }
  RobotReport report;
  report.robot = robot;
  report.stamp = stamp;
  report.frame_id = frame_id;
  report.frame_from_robot = PlanarTransform(x, y, yaw);
  return report;
}

}  // namespace hypermap::ros2
