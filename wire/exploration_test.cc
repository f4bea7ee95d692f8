#include "wire/exploration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hypermap::wire {
namespace {

using ::testing::HasSubstr;

ExplorationEntry SomeExploration() {
  ExplorationEntry entry;
  Exploration& exploration = entry.exploration;
  exploration.id = 7;
  exploration.area = Polygon::FromBox({{0, 0}, {4, 2}});
  exploration.occupancy_layer = "walls";
  exploration.exploration_layer = "seen";
  exploration.robot_radius_m = 0.3;
  exploration.range_m = 5.5;
  exploration.min_gain_cells = 9;
  exploration.state = ExplorationState::kEnded;
  exploration.end_reason = EndReason::kOnlyUnreachableLeft;
  exploration.started = absl::FromUnixMillis(1'700'000'000'250);
  exploration.ended = exploration.started + absl::Minutes(3);
  entry.goals = {{3, "r1", {1.5, -2.5}, 12, 1.25, absl::FromUnixSeconds(100)}};
  entry.unreachable_places = {{4, "r2", {3, 4}}, {5, "r1", {5, 6}}};
  return entry;
}

TEST(ExplorationOnTheWire, ComesBack) {
  v1::Exploration message;
  EncodeExploration(SomeExploration(), &message);
  const auto decoded = DecodeExploration("exploration", message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, SomeExploration());
}

TEST(ExplorationOnTheWire, OneThatGoesOnHasNoEnd) {
  ExplorationEntry active = SomeExploration();
  active.exploration.state = ExplorationState::kActive;
  active.exploration.end_reason = EndReason::kNone;
  active.exploration.ended.reset();
  v1::Exploration message;
  EncodeExploration(active, &message);
  EXPECT_FALSE(message.has_end_time());
  EXPECT_EQ(*DecodeExploration("exploration", message), active);
}

TEST(ExplorationOnTheWire, WithoutAStateItIsRefused) {
  v1::Exploration message;
  EncodeExploration(SomeExploration(), &message);
  message.clear_state();
  EXPECT_EQ(DecodeExploration("exploration", message).status(),
            absl::InvalidArgumentError("exploration.state is missing"));
}

TEST(GoalOnTheWire, WithoutAnEndHasNoExpireTime) {
  LeasedGoal goal = SomeExploration().goals.front();
  goal.expires_at = absl::UnixEpoch();
  v1::Goal message;
  EncodeGoal(goal, &message);
  EXPECT_FALSE(message.has_expire_time());
  EXPECT_EQ(*DecodeGoal("goal", message), goal);
}

TEST(GoalOutcomeOnTheWire, ComesBackAndMustBeKnown) {
  for (const GoalOutcome outcome :
       {GoalOutcome::kReached, GoalOutcome::kUnreachable, GoalOutcome::kAbandoned}) {
    EXPECT_EQ(*DecodeGoalOutcome("outcome", EncodeGoalOutcome(outcome)), outcome);
  }
  EXPECT_EQ(DecodeGoalOutcome("outcome", v1::GOAL_OUTCOME_UNSPECIFIED).status(),
            absl::InvalidArgumentError("outcome is missing"));
  const auto unknown = DecodeGoalOutcome("outcome", static_cast<v1::GoalOutcome>(99));
  EXPECT_THAT(std::string(unknown.status().message()), HasSubstr("99"));
}

TEST(ProgressOnTheWire, ComesBackWithItsFraction) {
  v1::ExplorationProgress message;
  EncodeProgress({{30, 10, 1000}, 0.25, 2.5}, &message);
  EXPECT_EQ(message.fraction(), 0.75);
  const ExplorationProgress decoded = DecodeProgress(message);
  EXPECT_EQ(decoded.cells.explored, 30);
  EXPECT_EQ(decoded.cells.reachable, 10);
  EXPECT_EQ(decoded.cells.unreachable, 1000);
  EXPECT_EQ(decoded.cell_area_m2, 0.25);
  EXPECT_EQ(decoded.rate_m2_per_s, 2.5);
  EXPECT_EQ(decoded.fraction(), 0.75);
}

TEST(FrontierOnTheWire, ComesBack) {
  for (const FrontierEntry& frontier :
       {FrontierEntry{2, {102, 51}, std::nullopt, 0, {{101, 51}, {103, 51}}},
        FrontierEntry{2, {102, 51}, Point{111, 61}, 17, {}}}) {
    v1::Frontier message;
    EncodeFrontier(frontier, &message);
    EXPECT_EQ(message.has_viewpoint(), frontier.viewpoint.has_value());
    const auto decoded = DecodeFrontier("frontier", message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, frontier);
  }
}

TEST(ClaimResultOnTheWire, ComesBack) {
  for (const ClaimResult& result :
       {ClaimResult{7, ExplorationState::kActive, EndReason::kNone, SomeExploration().goals[0]},
        ClaimResult{8, ExplorationState::kEnded, EndReason::kDone, std::nullopt}}) {
    v1::ClaimGoalResponse message;
    EncodeClaimResult(result, &message);
    const auto decoded = DecodeClaimResult(message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, result);
  }
}

}  // namespace
}  // namespace hypermap::wire
