// Tests of the exploration calls: requests to the server and decoding of its answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client_libs/cpp/client.h"
#include "client_libs/testing/scripted_server.h"
#include "client_libs/testing/text_message.h"

namespace hypermap::client {
namespace {

using hypermap::testing::ParseText;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Optional;
using ::testing::SizeIs;

constexpr char kEnded[] =
    "exploration { id: 4 state: EXPLORATION_STATE_ENDED end_reason: END_REASON_STOPPED "
    "area { outer { xs: [0, 3, 3] ys: [0, 0, 2] } } occupancy_layer: 'floor' "
    "exploration_layer: 'seen' robot_radius_m: 0.3 range_m: 5 min_gain_cells: 6 "
    "start_time { seconds: 10 } end_time { seconds: 70 } "
    "goals { id: 5 robot: 'r1' position { x: 1 y: 0.5 } gain_cells: 40 path_length_m: 2.5 "
    "expire_time { seconds: 60 } } "
    "unreachable_places { id: 6 robot: 'r2' position { x: 2 y: 1 } } }";

void ExpectEnded(const ExplorationEntry& entry) {
  const Exploration& exploration = entry.exploration;
  EXPECT_EQ(exploration.id, 4);
  EXPECT_EQ(exploration.state, ExplorationState::kEnded);
  EXPECT_EQ(exploration.end_reason, EndReason::kStopped);
  EXPECT_DOUBLE_EQ(Area(exploration.area), 3.0);
  EXPECT_EQ(exploration.occupancy_layer, "floor");
  EXPECT_EQ(exploration.exploration_layer, "seen");
  EXPECT_EQ(exploration.robot_radius_m, 0.3);
  EXPECT_EQ(exploration.range_m, 5.0);
  EXPECT_EQ(exploration.min_gain_cells, 6);
  EXPECT_EQ(exploration.started, absl::FromUnixSeconds(10));
  EXPECT_EQ(exploration.ended, absl::FromUnixSeconds(70));
  ASSERT_THAT(entry.goals, SizeIs(1));
  const LeasedGoal& goal = entry.goals[0];
  EXPECT_EQ(goal.id, 5);
  EXPECT_EQ(goal.robot, "r1");
  EXPECT_EQ(goal.position, (Point{1, 0.5}));
  EXPECT_EQ(goal.gain_cells, 40);
  EXPECT_EQ(goal.path_length_m, 2.5);
  EXPECT_EQ(goal.expires_at, absl::FromUnixSeconds(60));
  ASSERT_THAT(entry.unreachable_places, SizeIs(1));
  EXPECT_EQ(entry.unreachable_places[0].id, 6);
  EXPECT_EQ(entry.unreachable_places[0].robot, "r2");
  EXPECT_EQ(entry.unreachable_places[0].position, (Point{2, 1}));
}

TEST(ExplorationCallsTest, StartAsksForAllThatIsWanted) {
  Script script;
  script.started = ParseText<v1::StartExplorationResponse>("revision: 8 " + std::string(kEnded));
  ScriptedServer server(script);
  const auto answer =
      Client(server.address())
          .StartExploration("office", Polygon::FromBox({{0, 0}, {1, 2}}), "floor", "seen",
                            {.frame_id = "dock",
                             .robot_radius_m = 0.3,
                             .range_m = 5,
                             .min_gain_cells = 6,
                             .explored_rule = CellRule::kTouched},
                            {.request_id = "once"});
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 8);
  ExpectEnded(answer->entry);
  EXPECT_THAT(server.RequestIds(), ElementsAre("once"));
  EXPECT_THAT(
      server.Requests(),
      ElementsAre(R"(StartExploration map: "office" area { outer { xs: 0 xs: 1 xs: 1 xs: 0 )"
                  R"(ys: 0 ys: 0 ys: 2 ys: 2 } } frame_id: "dock" )"
                  R"(occupancy_layer: "floor" exploration_layer: "seen" )"
                  R"(explored_rule: CELL_RULE_TOUCHED robot_radius_m: 0.3 range_m: 5 )"
                  R"(min_gain_cells: 6)"));
}

TEST(ExplorationCallsTest, GetTellsTheProgress) {
  Script script;
  script.exploration = ParseText<v1::GetExplorationResponse>(
      "revision: 9 frame_id: 'dock' progress { explored_cells: 3 reachable_cells: 1 "
      "unreachable_cells: 2 fraction: 0.75 rate_m2_per_s: 0.5 cell_area_m2: 0.01 } " +
      std::string(kEnded));
  ScriptedServer server(script);
  const auto answer = Client(server.address()).GetExploration("office", 4, "dock");
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 9);
  EXPECT_EQ(answer->frame_id, "dock");
  ExpectEnded(answer->entry);
  EXPECT_EQ(answer->progress.cells.explored, 3);
  EXPECT_EQ(answer->progress.cells.reachable, 1);
  EXPECT_EQ(answer->progress.cells.unreachable, 2);
  EXPECT_EQ(answer->progress.fraction(), 0.75);
  EXPECT_EQ(answer->progress.rate_m2_per_s, 0.5);
  EXPECT_EQ(answer->progress.cell_area_m2, 0.01);
  EXPECT_THAT(server.Requests(),
              ElementsAre(R"(GetExploration map: "office" exploration_id: 4 frame_id: "dock")"));
}

TEST(ExplorationCallsTest, ListHasThemInTheServersOrder) {
  Script script;
  script.explorations = ParseText<v1::ListExplorationsResponse>(
      "revision: 9 frame_id: 'map' "
      "explorations { id: 7 state: EXPLORATION_STATE_ACTIVE area { outer { xs: [0, 3, 3] ys: [0, "
      "0, 2] } } } explorations { id: 4 "
      "state: EXPLORATION_STATE_ENDED end_reason: END_REASON_DONE area { outer { xs: [0, 3, 3] ys: "
      "[0, 0, 2] } } }");
  ScriptedServer server(script);
  const auto list = Client(server.address()).ListExplorations("office");
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->revision, 9);
  EXPECT_EQ(list->frame_id, "map");
  ASSERT_THAT(list->explorations, SizeIs(2));
  EXPECT_EQ(list->explorations[0].exploration.id, 7);
  EXPECT_EQ(list->explorations[0].exploration.end_reason, EndReason::kNone);
  EXPECT_EQ(list->explorations[0].exploration.ended, std::nullopt);
  EXPECT_EQ(list->explorations[1].exploration.id, 4);
  EXPECT_EQ(list->explorations[1].exploration.end_reason, EndReason::kDone);
}

TEST(ExplorationCallsTest, FrontiersMayHaveAViewpointAndCells) {
  Script script;
  script.frontiers = ParseText<v1::ListFrontiersResponse>(
      "revision: 9 frame_id: 'map' exploration_id: 4 "
      "frontiers { num_cells: 2 centroid { x: 1 } viewpoint { y: 2 } gain_cells: 30 "
      "cells { x: 0.5 } cells { x: 1.5 } } frontiers { num_cells: 1 centroid { y: 7 } }");
  ScriptedServer server(script);
  const auto list = Client(server.address()).ListFrontiers("office", 0, "", true);
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->revision, 9);
  EXPECT_EQ(list->frame_id, "map");
  EXPECT_EQ(list->exploration_id, 4);
  ASSERT_THAT(list->frontiers, SizeIs(2));
  EXPECT_EQ(list->frontiers[0].num_cells, 2);
  EXPECT_EQ(list->frontiers[0].centroid, (Point{1, 0}));
  EXPECT_EQ(list->frontiers[0].viewpoint, (Point{0, 2}));
  EXPECT_EQ(list->frontiers[0].gain_cells, 30);
  EXPECT_THAT(list->frontiers[0].cells, ElementsAre(Point{0.5, 0}, Point{1.5, 0}));
  EXPECT_EQ(list->frontiers[1].viewpoint, std::nullopt);
  EXPECT_THAT(list->frontiers[1].cells, IsEmpty());
  EXPECT_THAT(server.Requests(), ElementsAre(R"(ListFrontiers map: "office" with_cells: true)"));
}

TEST(ExplorationCallsTest, AClaimTellsWhereTheRobotIs) {
  Script script;
  script.claimed = ParseText<v1::ClaimGoalResponse>(
      "revision: 9 exploration_id: 4 state: EXPLORATION_STATE_ACTIVE "
      "goal { id: 5 robot: 'r1' position { x: 1 y: 0.5 } }");
  ScriptedServer server(script);
  const auto answer =
      Client(server.address())
          .ClaimGoal("office", "r1", {-1, 2},
                     {.exploration_id = 4, .frame_id = "dock", .lease = absl::Milliseconds(1500)});
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 9);
  EXPECT_EQ(answer->exploration_id, 4);
  EXPECT_EQ(answer->state, ExplorationState::kActive);
  EXPECT_THAT(answer->goal, Optional(Field(&LeasedGoal::position, Point{1, 0.5})));
  EXPECT_THAT(server.Requests(),
              ElementsAre(R"(ClaimGoal map: "office" exploration_id: 4 robot: "r1" )"
                          R"(pose { x: -1 y: 2 } frame_id: "dock" )"
                          R"(lease { seconds: 1 nanos: 500000000 })"));
}

TEST(ExplorationCallsTest, AClaimMayFindNothingLeft) {
  Script script;
  script.claimed = ParseText<v1::ClaimGoalResponse>(
      "state: EXPLORATION_STATE_ENDED end_reason: END_REASON_ONLY_UNREACHABLE_LEFT");
  ScriptedServer server(script);
  const auto answer = Client(server.address()).ClaimGoal("office", "r1", {0, 0});
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->state, ExplorationState::kEnded);
  EXPECT_EQ(answer->end_reason, EndReason::kOnlyUnreachableLeft);
  EXPECT_EQ(answer->goal, std::nullopt);
}

TEST(ExplorationCallsTest, GoalsAreRenewedAndReleased) {
  Script script;
  script.revision = 12;
  script.renewed =
      ParseText<v1::RenewGoalResponse>("goal { id: 5 expire_time { seconds: 99 } position {} }");
  script.stopped = ParseText<v1::StopExplorationResponse>(kEnded);
  ScriptedServer server(script);
  Client client(server.address());
  const auto goal = client.RenewGoal("office", "r1", 5, absl::Seconds(30));
  ASSERT_TRUE(goal.ok()) << goal.status();
  EXPECT_EQ(goal->expires_at, absl::FromUnixSeconds(99));
  EXPECT_EQ(client.ReleaseGoal("office", "r1", 5, GoalOutcome::kUnreachable).value_or(0), 12);
  const auto stopped = client.StopExploration("office", 4);
  ASSERT_TRUE(stopped.ok()) << stopped.status();
  ExpectEnded(*stopped);
  EXPECT_THAT(server.Requests(),
              ElementsAre(R"(RenewGoal map: "office" robot: "r1" goal_id: 5 lease { seconds: 30 })",
                          R"(ReleaseGoal map: "office" robot: "r1" goal_id: 5 )"
                          R"(outcome: GOAL_OUTCOME_UNREACHABLE)",
                          R"(StopExploration map: "office" exploration_id: 4)"));
}

TEST(ExplorationCallsTest, ClaimsAndReleasesAreTriedAgain) {
  Script script;
  script.outage = 1;
  script.claimed = ParseText<v1::ClaimGoalResponse>("state: EXPLORATION_STATE_ACTIVE");
  ScriptedServer claims(script);
  EXPECT_TRUE(Client(claims.address()).ClaimGoal("office", "r1", {0, 0}).ok());
  EXPECT_THAT(claims.Requests(), SizeIs(2));
  ScriptedServer releases(script);
  EXPECT_TRUE(
      Client(releases.address()).ReleaseGoal("office", "r1", 5, GoalOutcome::kReached).ok());
  EXPECT_THAT(releases.Requests(), SizeIs(2));
}

TEST(ExplorationCallsTest, ErrorsAreTheServersOwn) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "no goal 5");
  ScriptedServer server(script);
  Client client(server.address());
  const absl::Status expected = absl::NotFoundError("no goal 5");
  EXPECT_EQ(client.GetExploration("office").status(), expected);
  EXPECT_EQ(client.ListExplorations("office").status(), expected);
  EXPECT_EQ(client.ListFrontiers("office").status(), expected);
  EXPECT_EQ(client.ClaimGoal("office", "r1", {0, 0}).status(), expected);
  EXPECT_EQ(client.RenewGoal("office", "r1", 5).status(), expected);
  EXPECT_EQ(client.ReleaseGoal("office", "r1", 5, GoalOutcome::kReached).status(), expected);
  EXPECT_EQ(client.StopExploration("office").status(), expected);
}

TEST(ExplorationCallsTest, AnAnswerThatMakesNoSenseIsAnInternalError) {
  Script script;
  script.exploration = ParseText<v1::GetExplorationResponse>(
      "exploration { state: EXPLORATION_STATE_ACTIVE area { outer { xs: [nan] ys: [0] } } }");
  ScriptedServer server(script);
  Client client(server.address());
  const absl::Status no_area = client.GetExploration("office").status();
  EXPECT_EQ(no_area.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(no_area.message()), HasSubstr("exploration.area"));
  const absl::Status no_state = client.ClaimGoal("office", "r1", {0, 0}).status();
  EXPECT_EQ(no_state.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(no_state.message()), HasSubstr("state is missing"));
}

}  // namespace
}  // namespace hypermap::client
