#include "client_libs/ros2/conversion/poses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace hypermap::ros2 {
namespace {

geometry_msgs::PoseWithCovarianceStamped Pose(double x, double y, double yaw) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = {{12, 500'000'000}, "/map"};
  message.pose.pose.position = {x, y, 0.3};
  message.pose.pose.orientation = {0.0, 0.0, std::sin(yaw / 2), std::cos(yaw / 2)};
  return message;
}

TEST(PosesTest, PosesAreThoseOfThePlane) {
  auto message = Pose(1.5, -2.0, 2.5);
  message.pose.covariance[0] = 0.25;
  message.pose.covariance[1] = message.pose.covariance[6] = 0.01;
  message.pose.covariance[7] = 0.5;
  message.pose.covariance[14] = 9.0;  // of z
  message.pose.covariance[35] = 0.04;
  const auto report = ToReport("r1", message);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->robot, "r1");
  EXPECT_EQ(report->frame_id, "map");
  EXPECT_EQ(report->stamp, absl::FromUnixMillis(12'500));
  EXPECT_EQ(report->frame_from_robot.x(), 1.5);
  EXPECT_NEAR(report->frame_from_robot.yaw(), 2.5, 1e-12);
  ASSERT_TRUE(report->covariance.has_value());
  EXPECT_EQ((*report->covariance)(0, 1), 0.01);
  EXPECT_EQ((*report->covariance)(1, 1), 0.5);
  EXPECT_EQ((*report->covariance)(2, 2), 0.04);
}

TEST(PosesTest, NoCovarianceIsNone) {
  EXPECT_FALSE(ToReport("r1", Pose(0, 0, 0))->covariance.has_value());
}

TEST(PosesTest, APoseThatIsNotFiniteIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ToReport("r1", Pose(nan, 0, 0)).ok());
  EXPECT_FALSE(ToReport("r1", Pose(0, 0, nan)).ok());
}

TEST(PosesTest, ATransformIsAPoseWithoutCovariance) {
  const RigidTransform pose = {{1.5, -2.0, 0.3}, {0.0, 0.0, 0.0, 1.0}};
  const auto report = ToReport("r1", absl::FromUnixMillis(12'500), "", pose);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->stamp, absl::FromUnixMillis(12'500));
  EXPECT_EQ(report->frame_id, "");
  EXPECT_EQ(report->frame_from_robot.y(), -2.0);
  EXPECT_NEAR(std::abs(report->frame_from_robot.yaw()), std::numbers::pi, 1e-12);
  EXPECT_FALSE(report->covariance.has_value());
}

}  // namespace
}  // namespace hypermap::ros2
