#include "map/robots/robot_presence.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace hypermap {
namespace {

FrameTree SomeFrames() {
  FrameTree frames;
  EXPECT_TRUE(frames.Set({"map", "dock", PlanarTransform(10, 0, 0)}).ok());
  return frames;
}

RobotPresence At(const std::string& frame_id) {
  RobotPresence robot;
  robot.report.robot = "r1";
  robot.report.frame_id = frame_id;
  robot.report.frame_from_robot = PlanarTransform(1, 2, 0.5);
  robot.online = true;
  return robot;
}

TEST(InMapFrameTest, ConvertsPosesOfConnectedFrames) {
  const RobotPresence robot = InMapFrame(At("dock"), SomeFrames(), "map");
  EXPECT_TRUE(robot.in_map_frame);
  EXPECT_EQ(robot.report.frame_id, "map");
  EXPECT_EQ(robot.report.frame_from_robot, PlanarTransform(11, 2, 0.5));
  EXPECT_TRUE(robot.online);
}

TEST(InMapFrameTest, AnEmptyFrameIsTheMapsOwn) {
  const RobotPresence robot = InMapFrame(At(""), SomeFrames(), "map");
  EXPECT_TRUE(robot.in_map_frame);
  EXPECT_EQ(robot.report.frame_id, "map");
  EXPECT_EQ(robot.report.frame_from_robot, PlanarTransform(1, 2, 0.5));
}

TEST(InMapFrameTest, LeavesPosesOfOtherFramesAsTheyAre) {
  const RobotPresence robot = InMapFrame(At("odom"), SomeFrames(), "map");
  EXPECT_FALSE(robot.in_map_frame);
  EXPECT_EQ(robot.report.frame_id, "odom");
  EXPECT_EQ(robot.report.frame_from_robot, PlanarTransform(1, 2, 0.5));
}

TEST(CarryOutTest, KeepsTheStateThatTheChangesTell) {
  RobotPresence a = At("map"), b = At("map");
  a.report.robot = "a";
  b.report.robot = "b";
  std::map<std::string, RobotPresence> robots;
  CarryOut({.robots = {a, b}}, &robots);
  EXPECT_EQ(robots, (std::map<std::string, RobotPresence>{{"a", a}, {"b", b}}));
  b.online = false;
  CarryOut({.robots = {b}, .forgotten = {"a", "unknown"}}, &robots);
  EXPECT_EQ(robots, (std::map<std::string, RobotPresence>{{"b", b}}));
  CarryOut({.reset = true, .robots = {a}}, &robots);
  EXPECT_EQ(robots, (std::map<std::string, RobotPresence>{{"a", a}}));
}

}  // namespace
}  // namespace hypermap
