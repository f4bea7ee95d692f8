#include "client_libs/ros2/bridge/transform_buffer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace hypermap::ros2 {
namespace {

using AfterNewest = TransformBuffer::AfterNewest;

constexpr absl::Duration kMaxGap = absl::Milliseconds(500);

absl::Time TimeOf(int64_t milliseconds) { return absl::FromUnixMillis(milliseconds); }

// A transform at (x, 0, 0), turned by `yaw` about the third axis.
geometry_msgs::TransformStamped Edge(const std::string& parent, const std::string& child,
                                     int64_t milliseconds, double x, double yaw = 0.0) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = {static_cast<int32_t>(milliseconds / 1000),
                          static_cast<uint32_t>(milliseconds % 1000 * 1'000'000)};
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.transform.translation = {x, 0, 0};
  message.transform.rotation = {0, 0, std::sin(yaw / 2), std::cos(yaw / 2)};
  return message;
}

class TransformBufferTest : public ::testing::Test {
 protected:
  void Move(const std::string& parent, const std::string& child, int64_t milliseconds, double x,
            double yaw = 0.0) {
    EXPECT_TRUE(buffer_.Add(Edge(parent, child, milliseconds, x, yaw), false).ok());
  }
  void Fix(const std::string& parent, const std::string& child, double x, double yaw = 0.0) {
    EXPECT_TRUE(buffer_.Add(Edge(parent, child, 0, x, yaw), true).ok());
  }
  // The x of the source in the target.
  double XOf(const std::string& target, const std::string& source, int64_t milliseconds,
             AfterNewest after_newest = AfterNewest::kNothing) {
    const auto transform = buffer_.At(target, source, TimeOf(milliseconds), after_newest);
    EXPECT_TRUE(transform.ok()) << transform.status();
    return transform.ok() ? transform->translation.x() : NAN;
  }
  absl::StatusCode ErrorOf(const std::string& target, const std::string& source,
                           int64_t milliseconds, AfterNewest after_newest = AfterNewest::kNothing) {
    return buffer_.At(target, source, TimeOf(milliseconds), after_newest).status().code();
  }

  TransformBuffer buffer_{kMaxGap};
};

TEST_F(TransformBufferTest, EachTransformIsInterpolatedByItself) {
  Move("map", "odom", 1000, 2.0, 0.0);
  Move("map", "odom", 1400, 4.0, 0.8);
  Move("/odom", "/base", 1100, 1.0);
  Move("odom", "base", 1200, 3.0);
  Fix("base", "optical", 0.5, 0.1);
  const auto pose = buffer_.At("map", "optical", TimeOf(1150), AfterNewest::kNothing);
  ASSERT_TRUE(pose.ok()) << pose.status();
  // odom is at 2.75 and turned by 0.3, base is at 2 in it.
  EXPECT_NEAR(pose->translation.x(), 2.75 + 2.5 * std::cos(0.3), 1e-12);
  EXPECT_NEAR(pose->translation.y(), 2.5 * std::sin(0.3), 1e-12);
  EXPECT_NEAR(2 * std::atan2(pose->rotation.z(), pose->rotation.w()), 0.4, 1e-12);
}

TEST_F(TransformBufferTest, ASampleIsReturnedExactly) {
  Move("map", "base", 1000, 0.1);
  Move("map", "base", 1100, 0.3);
  EXPECT_EQ(XOf("map", "base", 1100), 0.3);
}

TEST_F(TransformBufferTest, FramesOfTwoBranchesAreConnected) {
  Move("map", "base", 1000, 5.0);
  Fix("base", "lidar", 0.25);
  Fix("base", "optical", 1.0);
  // Nothing is asked of map and base, which is not known at this time.
  EXPECT_EQ(XOf("lidar", "optical", 9000), 0.75);
  EXPECT_EQ(XOf("base", "map", 1000), -5.0);
  EXPECT_EQ(XOf("map", "map", 9000), 0.0);
}

TEST_F(TransformBufferTest, WhatMayStillComeIsUnavailable) {
  EXPECT_EQ(ErrorOf("map", "base", 1000), absl::StatusCode::kUnavailable);
  Move("odom", "base", 1000, 1.0);
  EXPECT_EQ(ErrorOf("map", "base", 1000), absl::StatusCode::kUnavailable);
  Move("map", "odom", 1000, 1.0);
  EXPECT_EQ(XOf("map", "base", 1000), 2.0);
  EXPECT_EQ(ErrorOf("map", "base", 1001), absl::StatusCode::kUnavailable);
  EXPECT_EQ(XOf("map", "base", 1020, AfterNewest::kHolds), 2.0);
  EXPECT_EQ(ErrorOf("map", "base", 1021, AfterNewest::kHolds), absl::StatusCode::kUnavailable);
}

TEST_F(TransformBufferTest, GapsAndTimesBeforeTheFirstSampleAreOutOfRange) {
  Move("map", "base", 1000, 1.0);
  EXPECT_EQ(XOf("map", "base", 980), 1.0);
  EXPECT_EQ(ErrorOf("map", "base", 979), absl::StatusCode::kOutOfRange);
  Move("map", "base", 1501, 2.0);
  EXPECT_EQ(ErrorOf("map", "base", 1200), absl::StatusCode::kOutOfRange);
  Move("map", "base", 1200, 3.0);  // a late one
  EXPECT_EQ(XOf("map", "base", 1100), 2.0);
}

TEST_F(TransformBufferTest, TenSecondsAreKept) {
  for (int i = 0; i <= 120; ++i) Move("map", "base", 1000 + 100 * i, i);
  EXPECT_EQ(XOf("map", "base", 3000), 20.0);
  EXPECT_EQ(ErrorOf("map", "base", 2950), absl::StatusCode::kOutOfRange);
}

TEST_F(TransformBufferTest, AClockThatIsSetBackBeginsAnew) {
  Move("map", "base", 100'000, 1.0);
  Move("map", "base", 1000, 2.0);
  EXPECT_EQ(XOf("map", "base", 1000), 2.0);
  EXPECT_EQ(ErrorOf("map", "base", 100'000), absl::StatusCode::kUnavailable);
}

TEST_F(TransformBufferTest, MovingTransformsWinOverStaticOnes) {
  Fix("map", "odom", 7.0);
  EXPECT_EQ(XOf("map", "odom", 1000), 7.0);
  Move("map", "odom", 1000, 1.0);
  Fix("building", "odom", 8.0);
  EXPECT_EQ(XOf("map", "odom", 1000), 1.0);
}

TEST_F(TransformBufferTest, AFrameMayGetAnotherParent) {
  Move("map", "box", 1000, 1.0);
  Move("map", "gripper", 1000, 5.0);
  Move("gripper", "box", 1100, 0.5);
  EXPECT_EQ(XOf("gripper", "box", 1100), 0.5);
  EXPECT_EQ(ErrorOf("gripper", "box", 1000), absl::StatusCode::kOutOfRange);
}

TEST_F(TransformBufferTest, CirclesHaveNoEnd) {
  Fix("a", "b", 1.0);
  Fix("b", "a", 1.0);
  EXPECT_EQ(ErrorOf("map", "a", 0), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ErrorOf("a", "map", 0), absl::StatusCode::kUnavailable);
}

TEST_F(TransformBufferTest, TheNewestIsAsOldAsItsOldestPart) {
  Fix("base", "optical", 0.5);
  EXPECT_EQ(buffer_.Newest("map", "optical").status().code(), absl::StatusCode::kUnavailable);
  Move("odom", "base", 1000, 1.0);
  Move("odom", "base", 1200, 3.0);
  Move("map", "odom", 1100, 10.0);
  auto newest = buffer_.Newest("map", "optical");
  ASSERT_TRUE(newest.ok()) << newest.status();
  EXPECT_EQ(newest->stamp, TimeOf(1100));
  EXPECT_EQ(newest->transform.translation.x(), 12.5);
  Move("map", "odom", 1300, 20.0);  // AMCL's transforms have stamps in the future
  newest = buffer_.Newest("map", "optical");
  ASSERT_TRUE(newest.ok()) << newest.status();
  EXPECT_EQ(newest->stamp, TimeOf(1200));
  EXPECT_EQ(newest->transform.translation.x(), 18.5);
}

TEST_F(TransformBufferTest, StaticTransformsTellNothingOfARobot) {
  Fix("map", "base", 1.0);
  EXPECT_EQ(buffer_.Newest("map", "base").status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(TransformBufferTest, OtherTransformsAreRefused) {
  for (const auto& [parent, child] : {std::pair("", "a"), {"a", ""}, {"a", "a"}, {"a", "/a"}}) {
    EXPECT_EQ(buffer_.Add(Edge(parent, child, 0, 0), false).code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(buffer_.Add(Edge("map", "base", 0, NAN), false).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(TransformBufferTest, FramesAreBounded) {
  for (int i = 0; i < 10'000; ++i) Fix("map", std::to_string(i), 1.0);
  EXPECT_EQ(buffer_.Add(Edge("map", "one more", 0, 0), true).code(),
            absl::StatusCode::kResourceExhausted);
  Fix("map", "0", 2.0);
}

}  // namespace
}  // namespace hypermap::ros2
