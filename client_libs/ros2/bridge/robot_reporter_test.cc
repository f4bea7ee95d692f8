#include "client_libs/ros2/bridge/robot_reporter.h"

#include <gtest/gtest.h>

namespace hypermap::ros2 {
namespace {

TEST(RobotTopicTest, NamesARobotAndATopic) {
  EXPECT_EQ(*ParseRobotTopic("r1=/r1/amcl_pose"), (RobotTopic{"r1", "/r1/amcl_pose"}));
  EXPECT_EQ(*ParseRobotTopic("a=b=/pose"), (RobotTopic{"a=b", "/pose"}));
}

TEST(RobotTopicTest, OthersAreRefused) {
  for (const char* text : {"", "r1", "r1=", "r1=pose", "=/pose", "r1=/"}) {
    EXPECT_EQ(ParseRobotTopic(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

}  // namespace
}  // namespace hypermap::ros2
