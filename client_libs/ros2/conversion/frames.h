// Depth images with their poses as frames of the FrameService.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_FRAMES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_FRAMES_H_

#include <array>

#include "absl/status/statusor.h"
#include "client_libs/ros2/conversion/rigid_transform.h"
#include "client_libs/ros2/messages/messages.h"
#include "hypermap/v1/frame_service.pb.h"

namespace hypermap::ros2 {

// Standard deviations of a pose's x, y (m) and yaw (rad), whose errors are taken to be independent.
using PoseSigma = std::array<double, 3>;

// The frame of a depth image, without instances. Its sequence is its stamp in nanoseconds, which no
// other frame of the camera has. INVALID_ARGUMENT as EncodeDepth.
absl::StatusOr<v1::RobotFrame> ToRobotFrame(const sensor_msgs::Image& depth,
                                            const v1::CameraModel& camera,
                                            const RigidTransform& map_from_camera,
                                            const PoseSigma& sigma);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_FRAMES_H_
