#include "wire/exploration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

using ::testing::HasSubstr;

// A quarter turn, then 10 m along x.
const PlanarTransform kFrameFromLayer(10.0, 0.0, std::numbers::pi / 2);

Exploration SomeExploration() {
  Exploration exploration;
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
  return exploration;
}

TEST(ExplorationOnTheWire, ComesBack) {
  v1::Exploration message;
  EncodeExploration({SomeExploration(), {}, {}}, PlanarTransform(), &message);
  const auto decoded = DecodeExploration("exploration", message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, SomeExploration());
}

TEST(ExplorationOnTheWire, OneThatGoesOnHasNoEnd) {
  Exploration active = SomeExploration();
  active.state = ExplorationState::kActive;
  active.end_reason = EndReason::kNone;
  active.ended.reset();
  v1::Exploration message;
  EncodeExploration({active, {}, {}}, PlanarTransform(), &message);
  EXPECT_FALSE(message.has_end_time());
  EXPECT_EQ(*DecodeExploration("exploration", message), active);
}

TEST(ExplorationOnTheWire, IsToldInTheFrameAskedFor) {
  v1::Exploration message;
  EncodeExploration({SomeExploration(), {}, {}}, kFrameFromLayer, &message);
  EXPECT_EQ(DecodeExploration("exploration", message)->area,
            kFrameFromLayer * SomeExploration().area);
}

TEST(ExplorationOnTheWire, WithoutAStateItIsRefused) {
  v1::Exploration message;
  EncodeExploration({SomeExploration(), {}, {}}, PlanarTransform(), &message);
  message.clear_state();
  EXPECT_EQ(DecodeExploration("exploration", message).status(),
            absl::InvalidArgumentError("exploration.state is missing"));
}

TEST(GoalOnTheWire, IsTheCentreOfItsCell) {
  ExplorationGoal goal;
  goal.id = 3;
  goal.exploration_id = 7;
  goal.robot = "r1";
  goal.cell = Polygon::FromBox({{1, 2}, {3, 4}});
  goal.gain_cells = 12;
  goal.path_length_m = 1.5;
  goal.expires_at = absl::FromUnixSeconds(100);
  UnreachablePlace place;
  place.id = 4;
  place.robot = "r2";
  place.cell = goal.cell;
  v1::Exploration message;
  EncodeExploration({SomeExploration(), {goal}, {place}}, kFrameFromLayer, &message);
  ASSERT_EQ(message.goals_size(), 1);
  const v1::Goal& told = message.goals(0);
  EXPECT_EQ(told.id(), 3);
  EXPECT_EQ(told.robot(), "r1");
  EXPECT_EQ(told.gain_cells(), 12);
  EXPECT_EQ(told.path_length_m(), 1.5);
  EXPECT_EQ(DecodeTime(told.expire_time()), absl::FromUnixSeconds(100));
  EXPECT_NEAR(told.position().x(), 7.0, 1e-12);
  EXPECT_NEAR(told.position().y(), 2.0, 1e-12);
  ASSERT_EQ(message.unreachable_places_size(), 1);
  EXPECT_EQ(message.unreachable_places(0).id(), 4);
  EXPECT_EQ(message.unreachable_places(0).robot(), "r2");
  EXPECT_NEAR(message.unreachable_places(0).position().x(), 7.0, 1e-12);
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

TEST(ProgressOnTheWire, FractionIsOfWhatCanBeSeen) {
  v1::ExplorationProgress message;
  EncodeProgress({30, 10, 1000}, 0.25, 2.5, &message);
  EXPECT_EQ(message.explored_cells(), 30);
  EXPECT_EQ(message.reachable_cells(), 10);
  EXPECT_EQ(message.unreachable_cells(), 1000);
  EXPECT_EQ(message.fraction(), 0.75);
  EXPECT_EQ(message.rate_m2_per_s(), 2.5);
  EXPECT_EQ(message.cell_area_m2(), 0.25);
  EncodeProgress({0, 0, 5}, 0.25, 0.0, &message);
  EXPECT_EQ(message.fraction(), 1.0);
}

TEST(FrontierOnTheWire, LiesAtItsCells) {
  const GridGeometry geometry{PlanarTransform(100, 0, 0), 2.0};
  Explorer::FrontierView frontier{{{0, 0}, {0, 1}}, std::nullopt};
  v1::Frontier message;
  EncodeFrontier(frontier, geometry, PlanarTransform(0, 50, 0), true, &message);
  EXPECT_EQ(message.num_cells(), 2);
  EXPECT_EQ(message.centroid().x(), 102.0);
  EXPECT_EQ(message.centroid().y(), 51.0);
  ASSERT_EQ(message.cells_size(), 2);
  EXPECT_EQ(message.cells(1).x(), 103.0);
  EXPECT_FALSE(message.has_viewpoint());

  frontier.viewpoint = {{5, 5}, 17};
  message.Clear();
  EncodeFrontier(frontier, geometry, PlanarTransform(0, 50, 0), false, &message);
  EXPECT_EQ(message.cells_size(), 0);
  EXPECT_EQ(message.viewpoint().x(), 111.0);
  EXPECT_EQ(message.viewpoint().y(), 61.0);
  EXPECT_EQ(message.gain_cells(), 17);
}

}  // namespace
}  // namespace hypermap::wire
