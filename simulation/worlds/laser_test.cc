#include "simulation/worlds/laser.h"

#include <cmath>
#include <numbers>

#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"
#include "map/exploration/viewshed.h"
#include "map/geometry/predicates.h"
#include "map/grid/cell_cover.h"

namespace hypermap::simulation {
namespace {

using ::hypermap::testing::DrawnFloor;
using ::hypermap::testing::RandomFloor;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;

TEST(LaserTest, SeesToTheFirstWallOrTheRange) {
  GridGeometry geometry;
  geometry.resolution_m = 0.5;
  const WallGrid walls(DrawnFloor({"......#.", "......#.", "......#."}), geometry, 2.0);
  const Polygon free = FreeBefore(walls, {1.25, 0.75, 0.0}, {0.2, 9.0});
  EXPECT_TRUE(Covers(free, {1.25, 0.75}));
  EXPECT_TRUE(Covers(free, {2.99, 0.75}));
  EXPECT_FALSE(Covers(free, {3.01, 0.75}));
  EXPECT_FALSE(Covers(free, {1.20, 0.75})) << "behind it";
  EXPECT_NEAR(FreeBefore(walls, {1.25, 0.75, 0.0}, {0.2, 1.0}).bounds().max.x, 2.25, 5e-3);
}

TEST(LaserTest, SeesNothingFromWithinAWall) {
  const WallGrid walls(DrawnFloor({"#.", ".."}), GridGeometry{{}, 0.5}, 2.0);
  EXPECT_TRUE(FreeBefore(walls, {0.25, 0.75, 0.0}, {0.5, 2.0}).empty());
  EXPECT_TRUE(FreeBefore(walls, {-3.0, 0.75, 0.0}, {0.5, 2.0}).empty());
}

// Four fans in all directions touch the cells that a robot there is assumed to see, except slivers
// behind slits, and cover no centre of a wall's cell.
TEST(LaserTest, AllRoundItSeesWhatIsInSight) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  int promised = 0, missed = 0;
  for (int round = 0; round < 40; ++round) {
    FloorPlan plan = RandomFloor(rng, 40, 0.08);
    const CellIndex robot = plan.CellOf(plan.values().size() / 2 + 20);
    plan.set(robot, Floor::kFree);
    const GridGeometry geometry{::hypermap::testing::RandomTransform(rng, 3), 0.1};
    const WallGrid walls(plan, geometry, 2.0);
    const Point at = geometry.CentreOf(robot);
    constexpr int32_t kRange = 15;
    std::vector<Polygon> seen;
    for (int i = 0; i < 4; ++i) {
      const LaserFan fan{0.26 * std::numbers::pi, kRange * 0.1};
      seen.push_back(FreeBefore(walls, {at.x, at.y, i * std::numbers::pi / 2}, fan));
    }
    CellRaster<uint8_t> touched(plan.box(), 0);
    for (const Polygon& free : seen) {
      const CellCover cover(free, geometry, plan.box(), CellRule::kTouched);
      for (int32_t row = cover.bounds().row_begin; row < cover.bounds().row_end; ++row) {
        for (const ColumnSpan& span : cover.SpansOfRow(row)) {
          for (int32_t col = span.col_begin; col < span.col_end; ++col) touched.set({row, col}, 1);
        }
      }
    }
    ViewshedRays(kRange).ForEachVisible(plan, robot, [&](const CellIndex& cell) {
      ++promised;
      missed += touched.at(cell) == 0;
    });
    for (size_t i = 0; i < plan.values().size(); ++i) {
      if (plan.values()[i] == Floor::kFree) continue;
      const Point centre = geometry.CentreOf(plan.CellOf(i));
      for (const Polygon& free : seen) EXPECT_FALSE(Covers(free, centre)) << "in a wall";
    }
  }
  EXPECT_GT(promised, 4000);
  EXPECT_LE(missed, promised / 500);
}

}  // namespace
}  // namespace hypermap::simulation
