#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "server/services/testing/test_server.h"
#include "tests/support/not_finite.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

using hypermap::testing::kNan;

v1::Polygon PolygonOf(const std::vector<Point>& points) {
  v1::Polygon message;
  for (const Point& p : points) {
    message.mutable_outer()->add_xs(p.x);
    message.mutable_outer()->add_ys(p.y);
  }
  return message;
}

// A map "site" with the occupancy layer "walls": 10 x 20 free cells of 0.5 m, from the origin on.
class ExplorationServiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    LayerSpec spec;
    spec.name = "walls";
    spec.kind = LayerKind::kOccupancy;
    spec.grid = GridGeometry{PlanarTransform(), 0.5};
    WriteCells free{"walls", {0, 10, 0, 20}, std::vector<std::optional<double>>(200, 0.0)};
    const FrameTransform turned{"map", "turned", PlanarTransform(10, 0, std::numbers::pi / 2)};
    server_.MakeMap("site", {{CreateLayer{spec}, free, SetTransform{turned}}});
  }

  v1::StartExplorationRequest StartRequest() const {
    v1::StartExplorationRequest request;
    request.set_map("site");
    *request.mutable_area() = PolygonOf({{0, 0}, {10, 0}, {10, 5}, {0, 5}});
    request.set_occupancy_layer("walls");
    request.set_exploration_layer("seen");
    return request;
  }
  v1::ClaimGoalRequest ClaimRequest(const std::string& robot, double x, double y) const {
    v1::ClaimGoalRequest request;
    request.set_map("site");
    request.set_robot(robot);
    request.mutable_pose()->set_x(x);
    request.mutable_pose()->set_y(y);
    return request;
  }

  // Calls a method of the stub.
  template <typename Method, typename Request, typename Response>
  grpc::Status Call(Method method, const Request& request, Response* response) {
    grpc::ClientContext context;
    context.AddMetadata("x-hypermap-author", "tester");
    return (server_.exploration.get()->*method)(&context, request, response);
  }
  grpc::Status Start(const v1::StartExplorationRequest& request,
                     v1::StartExplorationResponse* response) {
    return Call(&v1::ExplorationService::Stub::StartExploration, request, response);
  }
  grpc::Status Claim(const v1::ClaimGoalRequest& request, v1::ClaimGoalResponse* response) {
    return Call(&v1::ExplorationService::Stub::ClaimGoal, request, response);
  }

  void MarkAllExplored() {
    const auto session = server_.site().Find("site");
    WriteCells write{"seen", {0, 10, 0, 20}, std::vector<std::optional<double>>(200, 1.0)};
    ASSERT_TRUE((*session)->SubmitAndWait({{{write}}, "test", ""}).ok());
  }

  TestServer server_;
};

TEST_F(ExplorationServiceTest, AnExplorationFromItsStartToItsEnd) {
  v1::StartExplorationResponse started;
  ASSERT_TRUE(Start(StartRequest(), &started).ok());
  EXPECT_EQ(started.map(), "site");
  EXPECT_EQ(started.revision(), 2);
  EXPECT_EQ(started.exploration().state(), v1::EXPLORATION_STATE_ACTIVE);
  EXPECT_EQ(started.exploration().range_m(), 4.0);
  EXPECT_EQ(started.exploration().min_gain_cells(), 4);
  EXPECT_EQ(started.exploration().robot_radius_m(), 0.0);

  v1::ClaimGoalResponse claimed;
  ASSERT_TRUE(Claim(ClaimRequest("r1", 0.25, 0.25), &claimed).ok());
  EXPECT_EQ(claimed.exploration_id(), started.exploration().id());
  EXPECT_EQ(claimed.state(), v1::EXPLORATION_STATE_ACTIVE);
  ASSERT_TRUE(claimed.has_goal());
  EXPECT_EQ(claimed.goal().robot(), "r1");
  EXPECT_GT(claimed.goal().gain_cells(), 4);
  EXPECT_GT(wire::DecodeTime(claimed.goal().expire_time()), absl::Now());

  v1::RenewGoalRequest renew;
  renew.set_map("site");
  renew.set_robot("r1");
  renew.set_goal_id(claimed.goal().id());
  wire::EncodeDuration(absl::Minutes(5), renew.mutable_lease());
  v1::RenewGoalResponse renewed;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::RenewGoal, renew, &renewed).ok());
  EXPECT_GT(wire::DecodeTime(renewed.goal().expire_time()), absl::Now() + absl::Minutes(4));

  v1::GetExplorationRequest get;
  get.set_map("site");
  v1::GetExplorationResponse got;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::GetExploration, get, &got).ok());
  EXPECT_EQ(got.revision(), renewed.revision());
  EXPECT_EQ(got.frame_id(), "map");
  EXPECT_EQ(got.exploration().goals_size(), 1);
  EXPECT_EQ(got.progress().reachable_cells(), 200);
  EXPECT_EQ(got.progress().fraction(), 0.0);
  EXPECT_EQ(got.progress().cell_area_m2(), 0.25);

  MarkAllExplored();
  v1::ReleaseGoalRequest release;
  release.set_map("site");
  release.set_robot("r1");
  release.set_goal_id(claimed.goal().id());
  release.set_outcome(v1::GOAL_OUTCOME_REACHED);
  v1::ReleaseGoalResponse released;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::ReleaseGoal, release, &released).ok());
  EXPECT_EQ(released.revision(), renewed.revision() + 2);

  claimed.Clear();
  ASSERT_TRUE(Claim(ClaimRequest("r1", 0.25, 0.25), &claimed).ok());
  EXPECT_EQ(claimed.state(), v1::EXPLORATION_STATE_ENDED);
  EXPECT_EQ(claimed.end_reason(), v1::END_REASON_DONE);
  EXPECT_FALSE(claimed.has_goal());

  v1::ListExplorationsRequest list;
  list.set_map("site");
  v1::ListExplorationsResponse listed;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::ListExplorations, list, &listed).ok());
  ASSERT_EQ(listed.explorations_size(), 1);
  EXPECT_TRUE(listed.explorations(0).has_end_time());
}

TEST_F(ExplorationServiceTest, TheFeedTellsOfGoalsAndOfTheEnd) {
  v1::StartExplorationResponse started;
  ASSERT_TRUE(Start(StartRequest(), &started).ok());
  grpc::ClientContext context;
  v1::WatchRequest watch;
  watch.mutable_scope()->set_map("site");
  watch.mutable_scope()->add_layers("explorations");
  watch.set_start_revision(started.revision());
  const auto reader = server_.watch->Watch(&context, watch);
  v1::ClaimGoalResponse claimed;
  ASSERT_TRUE(Claim(ClaimRequest("r1", 0.25, 0.25), &claimed).ok());
  v1::StopExplorationRequest stop;
  stop.set_map("site");
  v1::StopExplorationResponse stopped;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::StopExploration, stop, &stopped).ok());
  EXPECT_EQ(stopped.exploration().end_reason(), v1::END_REASON_STOPPED);

  std::vector<std::string> told;
  v1::WatchResponse message;
  while (told.size() < 3 && reader->Read(&message)) {
    for (const v1::Change& change : message.changes()) {
      if (change.kind() == v1::CHANGE_KIND_REMOVE) told.push_back("removed");
      if (!change.has_object()) continue;
      told.push_back(change.object().label());
      if (told.back() == "exploration") {
        const auto& attributes = change.object().attributes();
        EXPECT_EQ(attributes.at("state").string_value(), "ended");
        EXPECT_EQ(attributes.at("end_reason").string_value(), "stopped");
      }
    }
  }
  context.TryCancel();
  // The end of the exploration removes the claimed goal.
  ASSERT_EQ(told.size(), 3u);
  EXPECT_EQ(told[0], "exploration goal");
  EXPECT_THAT(std::vector<std::string>(told.begin() + 1, told.end()),
              UnorderedElementsAre("exploration", "removed"));
}

TEST_F(ExplorationServiceTest, AnswersComeInTheFrameAskedFor) {
  v1::StartExplorationRequest start = StartRequest();
  start.set_frame_id("turned");
  // In the request's frame; x of the map is 10 - y, y of the map is x.
  *start.mutable_area() = PolygonOf({{0, 0}, {5, 0}, {5, 3}, {0, 3}});
  v1::StartExplorationResponse started;
  ASSERT_TRUE(Start(start, &started).ok());
  EXPECT_NEAR(started.exploration().area().outer().xs(1), 5.0, 1e-9);
  EXPECT_NEAR(started.exploration().area().outer().ys(1), 0.0, 1e-9);

  v1::ClaimGoalRequest claim = ClaimRequest("r1", 0.25, 0.25);
  claim.set_frame_id("turned");
  v1::ClaimGoalResponse claimed;
  ASSERT_TRUE(Claim(claim, &claimed).ok());
  EXPECT_EQ(claimed.frame_id(), "turned");
  v1::GetExplorationRequest get;
  get.set_map("site");
  v1::GetExplorationResponse in_map;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::GetExploration, get, &in_map).ok());
  EXPECT_EQ(in_map.progress().reachable_cells(), 60);
  const v1::Point& told = claimed.goal().position();
  EXPECT_NEAR(in_map.exploration().goals(0).position().x(), 10 - told.y(), 1e-9);
  EXPECT_NEAR(in_map.exploration().goals(0).position().y(), told.x(), 1e-9);

  const auto session = server_.site().Find("site");
  WriteCells write{"seen", {0, 10, 14, 16}, std::vector<std::optional<double>>(20, 1.0)};
  ASSERT_TRUE((*session)->SubmitAndWait({{{write}}, "test", ""}).ok());
  v1::ListFrontiersRequest list;
  list.set_map("site");
  list.set_frame_id("turned");
  list.set_with_cells(true);
  v1::ListFrontiersResponse listed;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::ListFrontiers, list, &listed).ok());
  ASSERT_EQ(listed.frontiers_size(), 1);
  const v1::Frontier& frontier = listed.frontiers(0);
  EXPECT_EQ(frontier.num_cells(), 10);
  EXPECT_EQ(frontier.cells_size(), 10);
  EXPECT_NEAR(frontier.centroid().x(), 2.5, 1e-9);
  EXPECT_NEAR(frontier.centroid().y(), 1.75, 1e-9);
  EXPECT_TRUE(frontier.has_viewpoint());
}

TEST_F(ExplorationServiceTest, TheSameRequestGetsTheSameAnswer) {
  v1::StartExplorationRequest request = StartRequest();
  request.set_request_id("r1");
  v1::StartExplorationResponse first, again;
  ASSERT_TRUE(Start(request, &first).ok());
  ASSERT_TRUE(Start(request, &again).ok());
  EXPECT_EQ(first.SerializeAsString(), again.SerializeAsString());
}

TEST_F(ExplorationServiceTest, WhatIsWrongIsRefusedByName) {
  const auto start = [this](auto change) {
    v1::StartExplorationRequest request = StartRequest();
    change(request);
    v1::StartExplorationResponse response;
    return Start(request, &response);
  };
  const auto claim = [this](auto change) {
    v1::ClaimGoalRequest request = ClaimRequest("r1", 0.25, 0.25);
    change(request);
    v1::ClaimGoalResponse response;
    return Claim(request, &response);
  };
  struct Case {
    grpc::Status status;
    grpc::StatusCode code;
    std::string named;
  };
  const auto invalid = grpc::StatusCode::INVALID_ARGUMENT;
  std::vector<Case> cases = {
      {start([](auto& r) { r.set_map("nowhere"); }), grpc::StatusCode::NOT_FOUND, "nowhere"},
      {start([](auto& r) { r.clear_area(); }), invalid, "area"},
      {start([](auto& r) { r.mutable_area()->Clear(); }), invalid, "area"},
      {start([](auto& r) {
         *r.mutable_area() = PolygonOf({{0, 0}, {2, 2}, {2, 0}, {0, 2}});
       }),
       invalid, "area"},
      {start([](auto& r) {
         *r.mutable_area() = PolygonOf({{0, 0}, {kNan, 2}, {2, 0}});
       }),
       invalid, "area.outer[1]"},
      {start([](auto& r) { r.set_occupancy_layer(""); }), invalid, "occupancy_layer"},
      {start([](auto& r) { r.set_exploration_layer(""); }), invalid, "exploration_layer"},
      {start([](auto& r) { r.set_explored_rule(static_cast<v1::CellRule>(9)); }), invalid,
       "explored_rule"},
      {start([](auto& r) { r.set_range_m(-1); }), invalid, "range_m"},
      {start([](auto& r) { r.set_min_gain_cells(-1); }), invalid, "min_gain_cells"},
      {start([](auto& r) { r.set_request_id(std::string(129, 'r')); }), invalid, "request_id"},
      {claim([](auto&) {}), grpc::StatusCode::NOT_FOUND, "no exploration"},
  };
  v1::StartExplorationResponse started;
  ASSERT_TRUE(Start(StartRequest(), &started).ok());
  cases.push_back({claim([](auto& r) { r.clear_pose(); }), invalid, "pose"});
  cases.push_back({claim([](auto& r) { r.mutable_pose()->set_x(kNan); }), invalid, "pose"});
  cases.push_back({claim([](auto& r) { r.clear_robot(); }), invalid, "robot"});
  cases.push_back({claim([](auto& r) { r.set_robot("r\n1"); }), invalid, "control characters"});
  cases.push_back({claim([](auto& r) { r.mutable_lease()->set_seconds(601); }), invalid, "lease"});
  cases.push_back({claim([](auto& r) { r.mutable_pose()->set_x(-40); }),
                   grpc::StatusCode::FAILED_PRECONDITION, "stands where it cannot go: (-40, "});
  v1::ReleaseGoalRequest release;
  release.set_map("site");
  release.set_robot("r1");
  release.set_goal_id(1);
  v1::ReleaseGoalResponse released;
  cases.push_back(
      {Call(&v1::ExplorationService::Stub::ReleaseGoal, release, &released), invalid, "outcome"});
  for (const Case& c : cases) {
    EXPECT_EQ(c.status.error_code(), c.code) << c.status.error_message();
    EXPECT_THAT(c.status.error_message(), HasSubstr(c.named));
  }
  v1::ListExplorationsRequest list;
  list.set_map("site");
  v1::ListExplorationsResponse listed;
  ASSERT_TRUE(Call(&v1::ExplorationService::Stub::ListExplorations, list, &listed).ok());
  EXPECT_EQ(listed.explorations_size(), 1);
  EXPECT_EQ(listed.revision(), started.revision());
}

}  // namespace
}  // namespace hypermap::server
