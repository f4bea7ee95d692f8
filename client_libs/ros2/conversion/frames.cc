#include "client_libs/ros2/conversion/frames.h"

#include "base/status/status_macros.h"
#include "client_libs/ros2/conversion/images.h"

namespace hypermap::ros2 {
namespace {

constexpr uint32_t kNanosPerSecond = 1'000'000'000;

void EncodePose(const RigidTransform& pose, const PoseSigma& sigma, v1::CameraPose* message) {
  message->set_x(pose.translation.x());
  message->set_y(pose.translation.y());
  message->set_z(pose.translation.z());
  message->set_qx(pose.rotation.x());
  message->set_qy(pose.rotation.y());
  message->set_qz(pose.rotation.z());
  message->set_qw(pose.rotation.w());
  for (size_t row = 0; row < sigma.size(); ++row) {
    for (size_t col = 0; col < sigma.size(); ++col) {
      message->add_covariance(row == col ? sigma[row] * sigma[row] : 0.0);
    }
  }
}

}  // namespace

absl::StatusOr<v1::RobotFrame> ToRobotFrame(const sensor_msgs::Image& depth,
                                            const v1::CameraModel& camera,
                                            const RigidTransform& map_from_camera,
                                            const PoseSigma& sigma) {
  const builtin_interfaces::Time& stamp = depth.header.stamp;
  v1::RobotFrame frame;
  frame.set_sequence(Nanoseconds(stamp));
  frame.mutable_stamp()->set_seconds(int64_t{stamp.sec} + stamp.nanosec / kNanosPerSecond);
  frame.mutable_stamp()->set_nanos(static_cast<int32_t>(stamp.nanosec % kNanosPerSecond));
  EncodePose(map_from_camera, sigma, frame.mutable_pose());
  HYPERMAP_RETURN_IF_ERROR(EncodeDepth(depth, camera, &frame));
  return frame;
}

}  // namespace hypermap::ros2
