#include "simulation/worlds/wall_grid.h"

#include <cmath>

#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"
#include "simulation/worlds/drive.h"
#include "simulation/worlds/renderer.h"

namespace hypermap::simulation {
namespace {

using ::hypermap::testing::RandomFloor;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::Uniform;

TEST(WallGridTest, RaysEndAtWallsAndAtTheFloor) {
  const FloorPlan plan = ::hypermap::testing::DrawnFloor({"....#", "....#"});
  GridGeometry geometry;
  geometry.resolution_m = 0.5;
  const WallGrid walls(plan, geometry, 1.0);
  EXPECT_EQ(walls.Hit({0.25, 0.25, 0.5}, {1, 0, 0}, 9), 1.75);
  EXPECT_EQ(walls.Hit({0.25, 0.25, 0.5}, {1, 0, 0}, 1.7), std::nullopt);
  EXPECT_EQ(walls.Hit({0.25, 0.25, 0.5}, {1, 0, -0.5}, 9), 1.0);
  EXPECT_EQ(walls.Hit({0.25, 0.25, 1.5}, {1, 0, 0}, 9), std::nullopt);   // Above the block.
  EXPECT_EQ(walls.Hit({0.25, 0.25, 2.0}, {1, 0, -0.5}, 9), 2.0);         // Onto its top.
  EXPECT_EQ(walls.Hit({0.25, 0.25, 0.5}, {-1, 0, 0}, 9), std::nullopt);  // Out of the plan.
  EXPECT_EQ(walls.Hit({0.25, 0.25, 0.5}, {-1, 0, -0.5}, 9), std::nullopt);
}

// The oracle renders the same cells as prisms.
TEST(WallGridTest, LooksLikeItsCellsAsPrisms) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const ingest::CameraModel camera{80, 60, 65, 65, 39.5, 29.5};
  for (int round = 0; round < 10; ++round) {
    FloorPlan plan = RandomFloor(rng, 24, 0.1);
    const CellIndex robot = plan.CellOf(plan.values().size() / 2 + 12);
    plan.set(robot, Floor::kFree);
    const GridGeometry geometry{::hypermap::testing::RandomTransform(rng, 3), 0.2};
    Scene by_grid, by_prisms;
    by_grid.walls.emplace(plan, geometry, 2.0);
    for (size_t i = 0; i < plan.values().size(); ++i) {
      const Polygon square = geometry.SquareOf(plan.CellOf(i));
      by_prisms.structure.push_back({square.outer(), -0.1, 0.0});
      if (plan.values()[i] == Floor::kFree) continue;
      by_prisms.structure.push_back({square.outer(), 0.0, 2.0});
    }
    const Point at = geometry.CentreOf(robot);
    const Eigen::Isometry3d pose =
        CameraPose(PlanarTransform(at.x, at.y, Uniform(rng, -M_PI, M_PI)));
    const View a = Render(by_grid, camera, pose), b = Render(by_prisms, camera, pose);
    int differing = 0;
    for (size_t i = 0; i < a.depth.metres.size(); ++i) {
      const float other = b.depth.metres[i] > 8.0f ? 0.0f : b.depth.metres[i];
      differing += std::abs(a.depth.metres[i] - other) > 1e-4f;
    }
    // A ray along an edge of a block may hit or miss it.
    EXPECT_LE(differing, 3);
  }
}

}  // namespace
}  // namespace hypermap::simulation
