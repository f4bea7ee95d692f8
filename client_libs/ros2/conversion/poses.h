// Poses of robots.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_POSES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_POSES_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/ros2/conversion/rigid_transform.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/robots/robot_report.h"

namespace hypermap::ros2 {

// The pose in the plane, with its heading about the vertical axis, and the covariance of (x, y,
// yaw); without a covariance if the message's is all zeros, by which nodes say that they know none.
// INVALID_ARGUMENT for a pose that is not finite.
absl::StatusOr<RobotReport> ToReport(const std::string& robot,
                                     const geometry_msgs::PoseWithCovarianceStamped& message);

// The same of a frame of the robot, without a covariance. `frame_id` may be empty: the map's own.
absl::StatusOr<RobotReport> ToReport(const std::string& robot, absl::Time stamp,
                                     const std::string& frame_id,
                                     const RigidTransform& frame_from_robot);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_POSES_H_
