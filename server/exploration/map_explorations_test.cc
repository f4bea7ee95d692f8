#include "server/exploration/map_explorations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/admission/budget.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "base/limits/limits.h"
#include "server/exploration/testing/exploration_site.h"
#include "tests/support/not_finite.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using hypermap::testing::kNan;

std::string MessageOf(const absl::Status& status) { return std::string(status.message()); }

class MapExplorationsTest : public ::testing::Test, public ExplorationSite {};

// Tests of Start.

TEST_F(MapExplorationsTest, StartMakesLayersAndExplorationAsOneRevision) {
  Draw({"....", "...."});
  ExplorationStart request = WholeArea();
  request.explored_rule = CellRule::kTouched;
  request.min_gain_cells = 2;
  const Revision before = snapshot()->revision;
  const auto started = explorations().Start(request);
  ASSERT_TRUE(started.ok()) << started.status();
  EXPECT_EQ(started->revision, before + 1);
  EXPECT_EQ(snapshot()->revision, before + 1);

  const Layer* seen = snapshot()->FindLayer("seen");
  ASSERT_NE(seen, nullptr);
  EXPECT_EQ(seen->spec().kind, LayerKind::kExploration);
  EXPECT_EQ(seen->spec().grid, snapshot()->FindLayer("walls")->spec().grid);
  EXPECT_EQ(seen->spec().explored_rule, CellRule::kTouched);

  const auto list = explorations().List("");
  ASSERT_TRUE(list.ok()) << list.status();
  ASSERT_THAT(list->explorations, SizeIs(1));
  const Exploration& kept = list->explorations.front().exploration;
  EXPECT_EQ(kept, started->objects.exploration);
  EXPECT_EQ(kept.area, request.area);
  EXPECT_EQ(kept.occupancy_layer, "walls");
  EXPECT_EQ(kept.exploration_layer, "seen");
  EXPECT_EQ(kept.min_gain_cells, 2);
  EXPECT_EQ(kept.started, Now());
  EXPECT_EQ(kept.state, ExplorationState::kActive);
}

TEST_F(MapExplorationsTest, TheSameRequestStartsNothingAndGetsTheSameAnswer) {
  Draw({"....", "...."});
  ExplorationStart request = WholeArea();
  request.request_id = "r1";
  const auto first = explorations().Start(request);
  ASSERT_TRUE(first.ok()) << first.status();
  const Revision after = snapshot()->revision;
  Advance(absl::Seconds(5));
  ASSERT_TRUE(explorations().Stop(0, "test").ok());
  Reopen();
  const auto again = explorations().Start(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision, first->revision);
  EXPECT_EQ(again->objects.exploration, first->objects.exploration);
  EXPECT_EQ(again->num_edits, 0);
  EXPECT_EQ(snapshot()->revision, after + 1);  // made by Stop
}

TEST_F(MapExplorationsTest, ARequestIdOfSomethingElseIsRefused) {
  Draw({"...."});
  Submit({{SetTransform{{"map", "robot", PlanarTransform()}}}}, "r1");
  ExplorationStart request = WholeArea();
  request.request_id = "r1";
  EXPECT_TRUE(absl::IsInvalidArgument(explorations().Start(request).status()));
}

TEST_F(MapExplorationsTest, BadOrdersAreRefusedByNameAndStartNothing) {
  Draw({"....", "...."});
  LayerSpec things;
  things.name = "things";
  Submit({{CreateLayer{things}}});
  const Revision before = snapshot()->revision;
  const auto refused = [this](auto change) {
    ExplorationStart request = WholeArea();
    change(request);
    return explorations().Start(request).status();
  };
  using Code = absl::StatusCode;
  struct Case {
    absl::Status status;
    Code code;
    std::string named;
  };
  const Case cases[] = {
      {refused([](auto& o) { o.occupancy_layer = "nowhere"; }), Code::kNotFound, "nowhere"},
      {refused([](auto& o) { o.occupancy_layer = "things"; }), Code::kFailedPrecondition, "things"},
      {refused([](auto& o) { o.exploration_layer = "things"; }), Code::kFailedPrecondition,
       "things"},
      {refused([](auto& o) { o.exploration_layer = "walls"; }), Code::kFailedPrecondition, "walls"},
      {refused([](auto& o) { o.exploration_layer = "a b"; }), Code::kInvalidArgument,
       "exploration_layer"},
      {refused([](auto& o) { o.exploration_layer = "explorations"; }), Code::kInvalidArgument,
       "exploration_layer"},
      {refused([](auto& o) { o.frame_id = "nowhere"; }), Code::kNotFound, "nowhere"},
      {refused([](auto& o) { o.robot_radius_m = -0.1; }), Code::kInvalidArgument, "robot_radius_m"},
      {refused([](auto& o) { o.robot_radius_m = 5.1; }), Code::kInvalidArgument, "robot_radius_m"},
      {refused([](auto& o) { o.range_m = kNan; }), Code::kInvalidArgument, "range_m"},
      {refused([](auto& o) { o.range_m = 50.1; }), Code::kInvalidArgument, "range_m"},
      {refused([](auto& o) { o.min_gain_cells = -1; }), Code::kInvalidArgument, "min_gain_cells"},
      {refused([](auto& o) { o.area = Rectangle(100, 100, 101, 101); }), Code::kFailedPrecondition,
       "walls"},
  };
  for (const Case& c : cases) {
    EXPECT_EQ(c.status.code(), c.code) << c.status;
    EXPECT_THAT(MessageOf(c.status), HasSubstr(c.named));
  }
  EXPECT_EQ(snapshot()->revision, before);
}

TEST_F(MapExplorationsTest, AnAreaWithoutFloorIsRefused) {
  Draw({"??##", "??##"});
  const auto started = explorations().Start(WholeArea());
  EXPECT_TRUE(absl::IsFailedPrecondition(started.status())) << started.status();
  EXPECT_THAT(MessageOf(started.status()), HasSubstr("no floor"));
  EXPECT_EQ(snapshot()->FindLayer("explorations"), nullptr);
}

TEST_F(MapExplorationsTest, OfAnAreaBeyondTheMapWhatTheMapHasCounts) {
  Draw({"....", "...."});
  ExplorationStart half = WholeArea();
  half.area = Rectangle(1.0, -50, 80, 50);
  ASSERT_TRUE(explorations().Start(half).ok());
  EXPECT_EQ(Progress().reachable, 4);
  ExplorationStart huge = WholeArea();
  huge.area = Rectangle(-4e8, -4e8, 4e8, 4e8);
  const auto started = explorations().Start(huge);
  ASSERT_TRUE(started.ok()) << started.status();
  EXPECT_EQ(Progress().reachable, 8);
  // Floor by which the map grows later is part of the exploration.
  Write({0, 2, 4, 300}, 0.0);
  EXPECT_EQ(Progress().reachable, 600);
}

TEST_F(MapExplorationsTest, AnAreaOfTooManyCellsIsRefusedNamingTheLimit) {
  set_max_exploration_cells(40);
  Reopen();
  Draw({"........", "........", "........"});
  // The box has 10 x 5 cells: the area and one cell on each side.
  const auto refused = explorations().Start(WholeArea());
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(MessageOf(refused.status()), HasSubstr("--max_exploration_cells"));
  ExplorationStart smaller = WholeArea();
  smaller.area = Rectangle(0, 0, 1, 1);
  EXPECT_TRUE(explorations().Start(smaller).ok());
}

TEST_F(MapExplorationsTest, SoManyGoOnAtATime) {
  Draw({"...."});
  for (size_t i = 0; i < FixedLimits::kMaxActiveExplorations; ++i) {
    ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  }
  EXPECT_TRUE(absl::IsResourceExhausted(explorations().Start(WholeArea()).status()));
  ASSERT_TRUE(explorations().Stop(0, "test").ok());
  EXPECT_TRUE(explorations().Start(WholeArea()).ok());
}

TEST_F(MapExplorationsTest, TheAreaMayBeGivenInAnyFrame) {
  Draw({"....", "...."});
  Submit({{SetTransform{{"map", "turned", PlanarTransform(2, 0, std::numbers::pi / 2)}}}});
  ExplorationStart request = WholeArea();
  request.frame_id = "turned";
  // In the request's frame; x of the map is 2 - y.
  request.area = Rectangle(0, 0, 1, 1);
  const auto started = explorations().Start(request);
  ASSERT_TRUE(started.ok()) << started.status();
  const Polygon told = started->frame_from_layer * started->objects.exploration.area;
  EXPECT_NEAR(told.bounds().max.x, 1.0, 1e-9);
  EXPECT_NEAR(told.bounds().min.x, 0.0, 1e-9);
  EXPECT_NEAR(Newest().exploration.area.bounds().min.x, 1.0, 1e-9);
  EXPECT_NEAR(Newest().exploration.area.bounds().max.x, 2.0, 1e-9);
  EXPECT_EQ(Progress().reachable, 4);
}

// Tests of Claim.

TEST_F(MapExplorationsTest, TheEndOfARoundWithTwoRobotsIsDone) {
  Draw({"...........",  //
        "...........",  //
        ".....#.....",  //
        "...........",  //
        "..........."});
  ExplorationStart request = WholeArea();
  request.range_m = 1.6;
  request.min_gain_cells = 1;
  ASSERT_TRUE(explorations().Start(request).ok());
  const Point starts[] = {{0.25, 0.25}, {5.25, 2.25}};
  const int goals = Explore({{"r1", starts[0]}, {"r2", starts[1]}}, 1.6);
  EXPECT_GT(goals, 2);
  const auto report = explorations().Get(0, "");
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->objects.exploration.state, ExplorationState::kEnded);
  EXPECT_EQ(report->objects.exploration.end_reason, EndReason::kDone);
  EXPECT_EQ(report->objects.exploration.ended, Now());
  EXPECT_THAT(report->objects.goals, IsEmpty());
  EXPECT_EQ(report->progress.cells.explored, 54);
  EXPECT_EQ(report->progress.cells.reachable, 0);
  EXPECT_EQ(report->progress.cells.unreachable, 0);
}

TEST_F(MapExplorationsTest, CrumbsAreWorthNobodysWay) {
  Draw({"......"});
  ExplorationStart request = WholeArea();
  request.min_gain_cells = 3;
  ASSERT_TRUE(explorations().Start(request).ok());
  MarkExplored({0, 1, 0, 4});
  const auto answer = Claim("r1", {0.25, 0.25});
  EXPECT_EQ(answer.state, ExplorationState::kEnded);
  EXPECT_EQ(answer.end_reason, EndReason::kDone);
  EXPECT_EQ(Progress().reachable, 2);
}

TEST_F(MapExplorationsTest, ARoomThatNobodyCanEnterEndsItAsUnreachable) {
  Draw({"....#....",  //
        "....#....",  //
        "....#...."});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  Explore({{"r1", {0.25, 0.25}}}, 4.0);
  const auto report = explorations().Get(0, "");
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->objects.exploration.end_reason, EndReason::kOnlyUnreachableLeft);
  EXPECT_EQ(report->progress.cells.explored, 12);
  EXPECT_EQ(report->progress.cells.reachable, 0);
  EXPECT_EQ(report->progress.cells.unreachable, 12);
  // After a restart the robots' positions are lost, but the reason for the end is on the map.
  Reopen();
  EXPECT_EQ(Progress().unreachable, 12);
}

TEST_F(MapExplorationsTest, RobotsInRoomsOfTheirOwnAreWaitedFor) {
  Draw({"....#....",  //
        "....#...."});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  ASSERT_TRUE(Claim("r2", {4.25, 0.25}).goal.has_value());
  Release("r2", GoalOutcome::kAbandoned);
  MarkExplored({0, 2, 0, 4});
  EXPECT_EQ(Claim("r1", {0.25, 0.25}).state, ExplorationState::kActive);
  // The exploration does not wait for an absent robot for ever.
  Advance(absl::Minutes(11));
  EXPECT_EQ(Claim("r1", {0.25, 0.25}).end_reason, EndReason::kOnlyUnreachableLeft);
}

TEST_F(MapExplorationsTest, WhatIsLookedAtTwiceAndNotSeenIsUnreachable) {
  Draw({"......"});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(Claim("r1", {0.25, 0.25}).goal.has_value());
    Release("r1", GoalOutcome::kReached);
  }
  EXPECT_EQ(Progress().unreachable, 6);
  EXPECT_EQ(Claim("r1", {0.25, 0.25}).end_reason, EndReason::kOnlyUnreachableLeft);
}

TEST_F(MapExplorationsTest, RobotsThatAskAtOnceAreNeverSentToOnePlace) {
  Draw(std::vector<std::string>(30, std::string(30, '.')));
  ExplorationStart request = WholeArea();
  request.range_m = 1.5;
  ASSERT_TRUE(explorations().Start(request).ok());
  std::vector<std::thread> robots;
  robots.reserve(8);
  for (int i = 0; i < 8; ++i) {
    robots.emplace_back([this, i] {
      const auto answer = explorations().Claim(
          {0, "r" + std::to_string(i), {7.0, 7.0}, "", absl::Minutes(1), "test"});
      EXPECT_TRUE(answer.ok()) << answer.status();
    });
  }
  for (std::thread& robot : robots) robot.join();
  std::set<std::pair<double, double>> places;
  const std::vector<ExplorationGoal> goals = Goals();
  for (const ExplorationGoal& goal : goals) {
    const Point centre = Centroid(goal.cell);
    places.insert({centre.x, centre.y});
  }
  EXPECT_THAT(goals, SizeIs(8));
  EXPECT_THAT(places, SizeIs(8));
}

TEST_F(MapExplorationsTest, ARobotHasOneGoal) {
  Draw(std::vector<std::string>(12, std::string(12, '.')));
  ExplorationStart request = WholeArea();
  request.range_m = 1.5;
  ASSERT_TRUE(explorations().Start(request).ok());
  const auto first = Claim("r1", {0.25, 0.25});
  const auto second = Claim("r1", {5.25, 5.25});
  ASSERT_TRUE(first.goal && second.goal);
  EXPECT_NE(first.goal->id, second.goal->id);
  EXPECT_THAT(Goals(), ElementsAre(*second.goal));
}

TEST_F(MapExplorationsTest, WithOthersOnTheWayToAllThatIsLeftARobotWaits) {
  Draw({"......"});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  ASSERT_TRUE(Claim("r1", {0.25, 0.25}).goal.has_value());
  const Revision before = snapshot()->revision;
  const auto waits = Claim("r2", {1.25, 0.25});
  EXPECT_FALSE(waits.goal.has_value());
  EXPECT_EQ(waits.state, ExplorationState::kActive);
  EXPECT_EQ(waits.num_edits, 0);
  EXPECT_EQ(snapshot()->revision, before);
}

TEST_F(MapExplorationsTest, ALeaseThatEndsGivesThePlaceToAnother) {
  Draw({"......"});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  const auto first = Claim("r1", {0.25, 0.25}, absl::Minutes(1));
  ASSERT_TRUE(first.goal.has_value());
  EXPECT_EQ(first.goal->expires_at, Now() + absl::Minutes(1));
  Advance(absl::Seconds(50));
  const auto renewed = explorations().Renew({"r1", first.goal->id, absl::Minutes(1), "test"});
  ASSERT_TRUE(renewed.ok()) << renewed.status();
  EXPECT_EQ(renewed->goal.expires_at, Now() + absl::Minutes(1));
  Advance(absl::Seconds(50));
  EXPECT_FALSE(Claim("r2", {0.25, 0.25}).goal.has_value());
  // The lease has ended, but the writer has not removed the goal yet.
  Advance(absl::Seconds(10));
  EXPECT_THAT(Goals(), IsEmpty());
  EXPECT_TRUE(absl::IsNotFound(
      explorations().Renew({"r1", first.goal->id, absl::Minutes(1), "test"}).status()));
  EXPECT_TRUE(absl::IsNotFound(
      explorations().Release({"r1", first.goal->id, GoalOutcome::kReached, "test"}).status()));
  const auto second = Claim("r2", {0.25, 0.25});
  ASSERT_TRUE(second.goal.has_value());
  EXPECT_EQ(second.goal->cell, first.goal->cell);
}

TEST_F(MapExplorationsTest, C1LeasesEndByTheTimeThatPassedWhateverTheClockSays) {
  for (const absl::Duration jump : {absl::Hours(9000), -absl::Hours(9000)}) {
    Draw({"......"});
    ASSERT_TRUE(explorations().Start(WholeArea()).ok());
    machine().Jump(jump);
    const auto before = Claim("r1", {0.25, 0.25}, absl::Minutes(8));
    ASSERT_TRUE(before.goal.has_value());
    Advance(absl::Minutes(7));
    EXPECT_FALSE(Claim("r2", {0.25, 0.25}).goal.has_value());
    const auto renewed = explorations().Renew({"r1", before.goal->id, absl::Minutes(8), "test"});
    ASSERT_TRUE(renewed.ok()) << renewed.status();
    // The server's clock goes where the wall clock is.
    Advance(absl::Minutes(4));
    const int64_t followed = session().options().clock->state().num_followed;
    EXPECT_FALSE(Claim("r2", {0.25, 0.25}).goal.has_value());
    EXPECT_GT(followed, 0);
    Advance(absl::Minutes(5));
    const auto after = Claim("r2", {0.25, 0.25});
    ASSERT_TRUE(after.goal.has_value());
    EXPECT_EQ(after.goal->cell, before.goal->cell);
    ASSERT_TRUE(explorations().Stop(0, "test").ok());
    Submit({{DeleteLayer{"walls"}, DeleteLayer{"seen"}}});
  }
}

TEST_F(MapExplorationsTest, GoalsBelongToTheirRobots) {
  Draw({"......"});
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  const ObjectId goal = Claim("r1", {0.25, 0.25}).goal->id;
  const auto release = [&](const std::string& robot, ObjectId id) {
    return explorations().Release({robot, id, GoalOutcome::kReached, "test"}).status();
  };
  EXPECT_TRUE(absl::IsNotFound(release("r2", goal)));
  EXPECT_TRUE(absl::IsNotFound(release("r1", goal + 1)));
  EXPECT_TRUE(absl::IsNotFound(release("r1", goal - 1)));  // the exploration
  EXPECT_TRUE(
      absl::IsNotFound(explorations().Renew({"r2", goal, absl::Minutes(1), "test"}).status()));
  EXPECT_TRUE(release("r1", goal).ok());
  EXPECT_TRUE(absl::IsNotFound(release("r1", goal)));
}

TEST_F(MapExplorationsTest, BadClaimsAreRefused) {
  Draw({"..#..."});
  EXPECT_TRUE(absl::IsNotFound(explorations().Claim({0, "r1", {0, 0}}).status()));
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  const Revision before = snapshot()->revision;
  const auto refused = [this](const GoalClaim& request) {
    return explorations().Claim(request).status();
  };
  const Point place{0.25, 0.25};
  EXPECT_TRUE(absl::IsNotFound(refused({99, "r1", place})));
  EXPECT_TRUE(absl::IsNotFound(refused({0, "r1", place, "nowhere"})));
  EXPECT_TRUE(absl::IsInvalidArgument(refused({0, "", place})));
  EXPECT_TRUE(absl::IsInvalidArgument(refused({0, std::string(129, 'r'), place})));
  EXPECT_TRUE(absl::IsInvalidArgument(refused({0, "r1", place, "", absl::ZeroDuration()})));
  EXPECT_TRUE(absl::IsInvalidArgument(refused({0, "r1", place, "", absl::Minutes(11)})));
  const absl::Status outside = refused({0, "r1", {70.0, 0.25}});
  EXPECT_TRUE(absl::IsFailedPrecondition(outside)) << outside;
  EXPECT_THAT(MessageOf(outside), HasSubstr("robot \"r1\" stands where it cannot go: (70, 0.25)"));
  EXPECT_TRUE(absl::IsFailedPrecondition(refused({0, "r1", {1e12, 0.0}})));
  EXPECT_EQ(snapshot()->revision, before);
}

TEST_F(MapExplorationsTest, B4_ExplorationsHaveABoundedMemoryTogether) {
  Draw({"....", "...."});
  const auto first = explorations().Start(WholeArea());
  ASSERT_TRUE(first.ok()) << first.status();
  const int64_t of_one = exploration_bytes().used();
  ASSERT_GT(of_one, 0);
  // Explorations of other maps leave room for two, and for what another one takes while it starts.
  admission::Budget::Charge others(&exploration_bytes(), "others");
  ASSERT_TRUE(others.Add(kMaxExplorationBytes - 13 * of_one / 4).ok());
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  const Revision before = snapshot()->revision;
  const int64_t of_two = exploration_bytes().used();
  EXPECT_EQ(of_two, kMaxExplorationBytes - 13 * of_one / 4 + 2 * of_one);
  const absl::Status third = explorations().Start(WholeArea()).status();
  EXPECT_TRUE(absl::IsResourceExhausted(third)) << third;
  EXPECT_THAT(MessageOf(third), HasSubstr("--max_exploration_bytes"));
  EXPECT_EQ(snapshot()->revision, before);
  EXPECT_EQ(exploration_bytes().used(), of_two);

  ASSERT_TRUE(explorations().Stop(first->objects.exploration.id, "test").ok());
  const auto again = explorations().Start(WholeArea());
  EXPECT_TRUE(again.ok()) << again.status();
}

TEST_F(MapExplorationsTest, B4_AnExplorationThatGrowsBeyondTheMemoryWaitsForRoom) {
  Draw({"....", "...."});
  ExplorationStart request = WholeArea();
  request.area = Rectangle(-100, -100, 200, 200);
  const auto started = explorations().Start(request);
  ASSERT_TRUE(started.ok()) << started.status();
  const int64_t before = exploration_bytes().used();
  std::optional<admission::Budget::Charge> others(std::in_place, &exploration_bytes(), "others");
  ASSERT_TRUE(others->Add(kMaxExplorationBytes - before).ok());
  // The map grows into the area by another tile.
  Write({200, 201, 200, 201}, 0.0);
  const absl::Status full = explorations().Get(0, "").status();
  EXPECT_TRUE(absl::IsResourceExhausted(full)) << full;
  EXPECT_THAT(MessageOf(full), HasSubstr("--max_exploration_bytes"));
  others.reset();
  EXPECT_TRUE(explorations().Get(0, "").ok());
  EXPECT_GT(exploration_bytes().used(), before);
  ASSERT_TRUE(explorations().Stop(0, "test").ok());
  EXPECT_EQ(exploration_bytes().used(), 0);
}

// Calls that are given up.

TEST_F(MapExplorationsTest, A4_StartIsGivenUpAndStartsNothing) {
  Draw(std::vector<std::string>(150, std::string(150, '.')));
  const Revision before = snapshot()->revision;
  {
    CancelledAfter cancelled(30);
    EXPECT_TRUE(absl::IsCancelled(explorations().Start(WholeArea()).status()));
  }
  EXPECT_EQ(snapshot()->revision, before);
  // The last run is not cancelled.
  EXPECT_GT(TimesCancelled([&] { return explorations().Start(WholeArea()).status(); }), 10);
  EXPECT_EQ(snapshot()->revision, before + 1);
  EXPECT_EQ(Progress().reachable, 150 * 150);
}

TEST_F(MapExplorationsTest, A4_ClaimIsGivenUpAndLeavesTheRestAsItWas) {
  const std::vector<std::string> floor(60, std::string(60, '.'));
  ExplorationSite twin;
  for (ExplorationSite* site : {static_cast<ExplorationSite*>(this), &twin}) {
    site->Draw(floor);
    ASSERT_TRUE(site->explorations().Start(site->WholeArea()).ok());
    site->LookRound({5, 5}, 4);
    // The followers forget what they know.
    site->Reopen();
  }
  const GoalClaim claim{0, "a", {5, 5}, "", absl::Minutes(1), "test"};
  const Revision before = snapshot()->revision;
  EXPECT_GT(TimesCancelled([&] { return explorations().Claim(claim).status(); }), 10);
  EXPECT_EQ(snapshot()->revision, before + 1);
  const ClaimAnswer expected = twin.Claim("a", {5, 5});
  ASSERT_TRUE(expected.goal);
  ASSERT_EQ(Goals().size(), 1u);
  EXPECT_EQ(Goals().front().cell, expected.goal->cell);
  EXPECT_EQ(Goals().front().gain_cells, expected.goal->gain_cells);
  EXPECT_EQ(Progress().reachable, twin.Progress().reachable);
  EXPECT_EQ(Progress().explored, twin.Progress().explored);
}

TEST_F(MapExplorationsTest, A4_CallsThatAreGivenUpFollowChangesToTheEnd) {
  Draw(std::vector<std::string>(60, std::string(60, '.')));
  ASSERT_TRUE(explorations().Start(WholeArea()).ok());
  MarkExplored({0, 40, 0, 60});
  Write({50, 60, 0, 60}, 1.0);
  const auto get = [this] { return explorations().Get(0, "").status(); };
  EXPECT_GT(TimesCancelled(get), 1);
  EXPECT_EQ(Progress().explored, 40 * 60);
  EXPECT_EQ(Progress().reachable, 10 * 60);
}

}  // namespace
}  // namespace hypermap::server
