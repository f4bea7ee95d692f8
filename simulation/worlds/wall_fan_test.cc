#include "simulation/worlds/wall_fan.h"

#include <cmath>

#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"

namespace hypermap::simulation {
namespace {

using ::hypermap::testing::RandomFloor;
using ::hypermap::testing::RandomTransform;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;

// Returns a direction of the view, or beside it.
Eigen::Vector3d DirectionNear(Rng& rng, const FanView& view) {
  const double forward = Uniform(rng, 0.2, 1.2);
  const double left = forward * Uniform(rng, view.slope_low - 0.1, view.slope_high + 0.1);
  return {forward * view.forward.x - left * view.forward.y,
          forward * view.forward.y + left * view.forward.x, Uniform(rng, -0.6, 0.4)};
}

TEST(WallFanTest, SeesWhatEachRayMeets) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  int differing = 0, walls_met = 0, rays = 0;
  for (int round = 0; round < 200; ++round) {
    FloorPlan plan = RandomFloor(rng, 60, Uniform(rng, 0.0, 0.2));
    const CellIndex robot = plan.CellOf(plan.values().size() / 2 + 30);
    if (round % 10 != 0) plan.set(robot, Floor::kFree);
    const WallGrid walls(plan, {RandomTransform(rng, 3), Uniform(rng, 0.05, 0.3)}, 2.0);
    const Point at = walls.geometry().CentreOf(robot);
    const double yaw = Uniform(rng, -M_PI, M_PI);
    const FanView view{{at.x, at.y, Uniform(rng, -0.3, 2.2)},
                       {std::cos(yaw), std::sin(yaw)},
                       Uniform(rng, -1.0, 0.0),
                       Uniform(rng, 0.1, 1.0),
                       8.0};
    const WallFan fan(walls, view);
    for (int i = 0; i < 2000; ++i, ++rays) {
      const Eigen::Vector3d direction = DirectionNear(rng, view);
      const auto expected = walls.Hit(view.origin, direction, 8.0);
      const auto hit = fan.Hit(direction, 8.0);
      walls_met += expected && view.origin.z() + *expected * direction.z() > 1e-9;
      differing += expected.has_value() != hit.has_value() ||
                   (hit && std::abs(*hit - *expected) > 1e-9 * (1 + *expected));
    }
  }
  // A ray through a corner that two blocks share may pass between them or meet one.
  EXPECT_LE(differing, rays / 100'000);
  EXPECT_GT(walls_met, rays / 10);
}

TEST(WallFanTest, ARayAlongACorridorMeetsItsEnd) {
  const FloorPlan plan = ::hypermap::testing::DrawnFloor({"########", ".......#", "########"});
  GridGeometry geometry;
  geometry.resolution_m = 0.5;
  const WallGrid walls(plan, geometry, 1.0);
  const WallFan fan(walls, {{0.25, 0.75, 0.5}, {1, 0}, -0.5, 0.5, 9.0});
  EXPECT_EQ(fan.Hit({1, 0, 0}, 9), 3.25);
  EXPECT_EQ(fan.Hit({1, 0, 0}, 3), std::nullopt);
  EXPECT_EQ(fan.Hit({1, 0, 1}, 9), std::nullopt);  // Above the end.
  EXPECT_EQ(fan.Hit({1, 0, -0.5}, 9), 1.0);        // The floor.
  EXPECT_EQ(fan.Hit({1, 0.25, 0}, 9), 1.0);        // The left wall.
}

}  // namespace
}  // namespace hypermap::simulation
