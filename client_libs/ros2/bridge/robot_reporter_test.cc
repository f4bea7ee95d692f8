#include "client_libs/ros2/bridge/robot_reporter.h"

#include <gtest/gtest.h>

namespace hypermap::ros2 {
namespace {

TEST(RobotSourceTest, NamesARobotAndATopicOrAFrame) {
  EXPECT_EQ(*ParseRobotSource("r1=/r1/amcl_pose"), (RobotSource{"r1", "/r1/amcl_pose", ""}));
  EXPECT_EQ(*ParseRobotSource("a=b=/pose"), (RobotSource{"a=b", "/pose", ""}));
  EXPECT_EQ(*ParseRobotSource("r1=tf:base_link"), (RobotSource{"r1", "", "base_link"}));
  EXPECT_EQ(*ParseRobotSource("r1=tf:r1/base_link"), (RobotSource{"r1", "", "r1/base_link"}));
}

TEST(RobotSourceTest, OthersAreRefused) {
  for (const char* text :
       {"", "r1", "r1=", "r1=pose", "=/pose", "r1=/", "r1=tf:", "=tf:base", "tf:a"}) {
    EXPECT_EQ(ParseRobotSource(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

}  // namespace
}  // namespace hypermap::ros2
