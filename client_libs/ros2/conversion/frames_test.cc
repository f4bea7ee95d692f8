#include "client_libs/ros2/conversion/frames.h"

#include <gtest/gtest.h>

namespace hypermap::ros2 {
namespace {

TEST(FramesTest, AFrameHasItsStampPoseAndDepth) {
  v1::CameraModel camera;
  camera.set_width(1);
  camera.set_height(1);
  sensor_msgs::Image depth;
  depth.header = {{1500, 200'000'000}, "optical"};
  depth.width = depth.height = 1;
  depth.step = 2;
  depth.encoding = "16UC1";
  depth.data = {'A', 'B'};
  const RigidTransform pose = {{1.0, 2.0, 3.0}, {0.5, -0.5, 0.5, -0.5}};
  const auto frame = ToRobotFrame(depth, camera, pose, {0.5, 0.25, 0.125});
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->ShortDebugString(),
            "sequence: 1500200000000 stamp { seconds: 1500 nanos: 200000000 } "
            "pose { x: 1 y: 2 z: 3 qx: -0.5 qy: 0.5 qz: -0.5 qw: 0.5 "
            "covariance: 0.25 covariance: 0 covariance: 0 "
            "covariance: 0 covariance: 0.0625 covariance: 0 "
            "covariance: 0 covariance: 0 covariance: 0.015625 } millimetres: \"AB\"");
  depth.data.pop_back();
  EXPECT_EQ(ToRobotFrame(depth, camera, pose, {}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace hypermap::ros2
