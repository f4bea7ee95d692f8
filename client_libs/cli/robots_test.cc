// Tests of the command robots: requests and output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "client_libs/cli/testing/run.h"
#include "client_libs/testing/scripted_server.h"
#include "client_libs/testing/text_message.h"

namespace hypermap::cli {
namespace {

using client::Script;
using client::ScriptedServer;
using hypermap::testing::ParseText;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kRobots[] =
    "robots { report { robot: 'r1' stamp { seconds: 10 } frame_id: 'map' pose { x: 1.5 y: 2 } "
    "battery: 0.8 map_revision: 7 state: 'driving' fields { key: 'task' value: '12' } } "
    "in_map_frame: true online: true seen_time { seconds: 11 } } "
    "robots { report { robot: 'r2' stamp { seconds: 1 } frame_id: 'odom' pose { x: 3 } } "
    "seen_time { seconds: 2 } }";

Script TwoRobots() {
  Script script;
  script.robots = ParseText<v1::ListRobotsResponse>(
      "map: 'office' revision: 9 frame_id: 'map' time { seconds: 12 } " + std::string(kRobots));
  script.watched_robots.responses = {
      ParseText<v1::WatchRobotsResponse>("reset: true " + std::string(kRobots)),
      ParseText<v1::WatchRobotsResponse>("forgotten: 'r2'")};
  return script;
}

TEST(RobotsTest, AreListedInATable) {
  ScriptedServer server(TwoRobots());
  const Outcome result = RunOn(server, {"robots", "office"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(
      result.out,
      "ROBOT  STATE    SEEN [s ago]  X [m]  Y [m]  YAW [rad]  FRAME  BATTERY [%]  REVISION  DOING\n"
      "r1     online              1    1.5      2          0  map             80         7  "
      "driving\n"
      "r2     offline            10      3      0          0  odom\n"
      "2 robots, revision 9\n");
  EXPECT_THAT(server.Requests(), ElementsAre(R"(ListRobots map: "office")"));
}

TEST(RobotsTest, AreListedAsJson) {
  ScriptedServer server(TwoRobots());
  const json list = json::parse(RunOn(server, {"--json", "robots", "office"}).out);
  EXPECT_EQ(list["map"], "office");
  EXPECT_EQ(list["frame_id"], "map");
  ASSERT_EQ(list["robots"].size(), 2u);
  const json& robot = list["robots"][0];
  EXPECT_EQ(robot["robot"], "r1");
  EXPECT_EQ(robot["online"], true);
  EXPECT_EQ(robot["pose"], (json{1.5, 2, 0}));
  EXPECT_EQ(robot["battery"], 0.8);
  EXPECT_EQ(robot["fields"]["task"], "12");
  EXPECT_FALSE(list["robots"][1].contains("battery"));
  EXPECT_EQ(list["robots"][1]["in_map_frame"], false);
}

TEST(RobotsTest, AreFollowedLineByLine) {
  ScriptedServer server(TwoRobots());
  EXPECT_EQ(RunOn(server, {"robots", "office", "--follow"}).out,
            "r1  online  (1.5, 2) in map, yaw 0, battery 80 %, driving\n"
            "r2  offline  (3, 0) in odom, yaw 0\n"
            "r2  forgotten\n");
  const std::string lines = RunOn(server, {"--json", "robots", "office", "--follow"}).out;
  EXPECT_THAT(lines, HasSubstr(R"({"robot":"r1","online":true,)"));
  EXPECT_THAT(lines, HasSubstr("{\"robot\":\"r2\",\"forgotten\":true}\n"));
}

}  // namespace
}  // namespace hypermap::cli
