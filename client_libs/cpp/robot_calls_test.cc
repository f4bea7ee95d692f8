// Tests of the calls about robots: requests to the server and decoding of its answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>

#include "client_libs/cpp/client.h"
#include "client_libs/testing/scripted_server.h"
#include "client_libs/testing/text_message.h"

namespace hypermap::client {
namespace {

using hypermap::testing::ParseText;
using ::testing::ElementsAre;
using ::testing::SizeIs;

constexpr char kRobot[] =
    "robots { report { robot: 'r1' stamp { seconds: 10 } frame_id: 'map' pose { x: 1 y: 2 } "
    "battery: 0.5 } in_map_frame: true online: true seen_time { seconds: 11 } }";

TEST(RobotCallsTest, AReportTellsWhatTheRobotKnows) {
  Script script;
  script.reported =
      ParseText<v1::ReportResponse>("revision: 8 incarnation: 9 outcome: REPORT_OUTCOME_OUTDATED");
  ScriptedServer server(script);
  RobotReport report;
  report.robot = "r1";
  report.stamp = absl::FromUnixSeconds(10);
  report.frame_from_robot = PlanarTransform(1, 2, 0);
  report.map_revision = 7;
  report.state = "driving";
  const auto answer = Client(server.address()).ReportRobot("office", report);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 8);
  EXPECT_EQ(answer->incarnation, 9u);
  EXPECT_FALSE(answer->accepted);
  EXPECT_THAT(server.Requests(),
              ElementsAre(R"(Report map: "office" report { robot: "r1" stamp { seconds: 10 } )"
                          R"(pose { x: 1 y: 2 } map_revision: 7 state: "driving" })"));
}

TEST(RobotCallsTest, AListHasAllRobots) {
  Script script;
  script.robots = ParseText<v1::ListRobotsResponse>(
      "revision: 3 frame_id: 'map' time { seconds: 12 } " + std::string(kRobot));
  ScriptedServer server(script);
  const auto list = Client(server.address()).ListRobots("office");
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->at.revision, 3);
  EXPECT_EQ(list->at.time, absl::FromUnixSeconds(12));
  ASSERT_THAT(list->robots, SizeIs(1));
  EXPECT_EQ(list->robots[0].report.robot, "r1");
  EXPECT_EQ(list->robots[0].report.battery, 0.5);
  EXPECT_TRUE(list->robots[0].online);
  EXPECT_EQ(list->robots[0].seen_at, absl::FromUnixSeconds(11));
}

TEST(RobotCallsTest, AnAnswerThatCantBeReadIsAnInternalError) {
  Script script;
  script.robots = ParseText<v1::ListRobotsResponse>("robots { report { robot: 'r1' } }");
  ScriptedServer server(script);
  EXPECT_EQ(Client(server.address()).ListRobots("office").status(),
            absl::InternalError("the server's answer: robots[0].report.stamp is missing"));
}

TEST(RobotCallsTest, AWatchTellsTheStateOfTheServer) {
  Script script;
  script.watched_robots.responses = {
      ParseText<v1::WatchRobotsResponse>("reset: true " + std::string(kRobot)),
      ParseText<v1::WatchRobotsResponse>("forgotten: 'r1'")};
  script.watched_robots.status = {grpc::StatusCode::UNAVAILABLE, "the map is closing"};
  ScriptedServer server(script);
  RobotReader reader = Client(server.address()).WatchRobots("office");
  std::map<std::string, RobotPresence> robots = {{"unknown to the server", {}}};
  std::optional<RobotChanges> changes = reader.Next();
  ASSERT_TRUE(changes.has_value()) << reader.status();
  CarryOut(*changes, &robots);
  ASSERT_THAT(robots, SizeIs(1));
  EXPECT_EQ(robots.begin()->first, "r1");
  changes = reader.Next();
  ASSERT_TRUE(changes.has_value()) << reader.status();
  CarryOut(*changes, &robots);
  EXPECT_TRUE(robots.empty());
  EXPECT_FALSE(reader.Next().has_value());
  EXPECT_EQ(reader.status(), absl::UnavailableError("the map is closing"));
}

}  // namespace
}  // namespace hypermap::client
