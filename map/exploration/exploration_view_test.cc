#include "map/exploration/exploration_view.h"

#include <gtest/gtest.h>

#include <numbers>

namespace hypermap {
namespace {

// A quarter turn, then 10 m along x.
const PlanarTransform kFrameFromLayer(10.0, 0.0, std::numbers::pi / 2);

TEST(ExplorationView, IsInTheCallersFrame) {
  ExplorationObjects objects;
  objects.exploration.id = 7;
  objects.exploration.area = Polygon::FromBox({{0, 0}, {4, 2}});
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
  objects.goals = {goal};
  objects.unreachable_places = {place};

  const ExplorationEntry entry = ViewOf(objects, kFrameFromLayer);
  EXPECT_EQ(entry.exploration.id, 7);
  EXPECT_EQ(entry.exploration.area, kFrameFromLayer * objects.exploration.area);
  ASSERT_EQ(entry.goals.size(), 1u);
  EXPECT_EQ(entry.goals[0].id, 3);
  EXPECT_EQ(entry.goals[0].robot, "r1");
  EXPECT_NEAR(entry.goals[0].position.x, 7.0, 1e-12);
  EXPECT_NEAR(entry.goals[0].position.y, 2.0, 1e-12);
  EXPECT_EQ(entry.goals[0].gain_cells, 12);
  EXPECT_EQ(entry.goals[0].path_length_m, 1.5);
  EXPECT_EQ(entry.goals[0].expires_at, absl::FromUnixSeconds(100));
  ASSERT_EQ(entry.unreachable_places.size(), 1u);
  EXPECT_EQ(entry.unreachable_places[0].id, 4);
  EXPECT_EQ(entry.unreachable_places[0].robot, "r2");
  EXPECT_NEAR(entry.unreachable_places[0].position.x, 7.0, 1e-12);
}

TEST(ExplorationProgress, FractionIsOfTheReachableFloor) {
  EXPECT_EQ((ExplorationProgress{{30, 10, 1000}, 0.25, 2.5}).fraction(), 0.75);
  EXPECT_EQ((ExplorationProgress{{0, 0, 5}, 0.25, 0.0}).fraction(), 1.0);
}

TEST(FrontierView, LiesAtItsCells) {
  const GridGeometry geometry{PlanarTransform(100, 0, 0), 2.0};
  const PlanarTransform frame_from_floor(0, 50, 0);
  Explorer::FrontierView frontier{{{0, 0}, {0, 1}}, std::nullopt};
  const FrontierEntry unseen = ViewOf(frontier, geometry, frame_from_floor, /*with_cells=*/true);
  EXPECT_EQ(unseen, (FrontierEntry{2, {102, 51}, std::nullopt, 0, {{101, 51}, {103, 51}}}));

  frontier.viewpoint = {{5, 5}, 17};
  const FrontierEntry seen = ViewOf(frontier, geometry, frame_from_floor, /*with_cells=*/false);
  EXPECT_EQ(seen, (FrontierEntry{2, {102, 51}, Point{111, 61}, 17, {}}));
}

}  // namespace
}  // namespace hypermap
