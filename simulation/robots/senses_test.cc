#include "simulation/robots/senses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "map/geometry/predicates.h"
#include "simulation/robots/terrain.h"
#include "simulation/robots/testing/drawn_site.h"
#include "simulation/worlds/world_from_map.h"

namespace hypermap::robots {
namespace {

// A room of 6 x 6 m with a suitcase in it, 2 m east of the middle of its west side.
class SensesTest : public ::testing::Test {
 protected:
  SensesTest() : site_(DrawnSite(Room(), 0.1)) {
    SemanticObject suitcase;
    suitcase.label = "suitcase";
    suitcase.shape = Polygon::FromBox({{3.0, 2.8}, {3.4, 3.2}});
    const Terrain terrain(*site_, Polygon::FromBox({{0, 0}, {6, 6}}), 0.2);
    world_.emplace(World{simulation::WorldFromMap(terrain.plan(), terrain.geometry(), {suitcase}),
                         {terrain.plan(), terrain.geometry(), simulation::kWallHeight_m}});
  }

  static std::vector<std::string> Room() {
    std::vector<std::string> lines(60, "#" + std::string(58, '.') + "#");
    lines.front() = lines.back() = std::string(60, '#');
    return lines;
  }

  std::shared_ptr<const GridLayer> site_;
  std::optional<World> world_;
};

TEST_F(SensesTest, SeesTheThingAndTheFloor) {
  Senses senses(*world_, site_, {.range_m = 4.0});
  const PlanarTransform pose(1.0, 3.0, 0.0);
  EXPECT_EQ(senses.Localise(pose), pose);
  const absl::StatusOr<Observation> seen = senses.Observe(pose, pose);
  ASSERT_TRUE(seen.ok()) << seen.status();
  ASSERT_EQ(seen->detections.size(), 1u);
  EXPECT_EQ(seen->detections[0].scores.begin()->first, "suitcase");
  const Point middle = Centroid(seen->detections[0].hull);
  EXPECT_NEAR(middle.x, 3.15, 0.15);
  EXPECT_NEAR(middle.y, 3.0, 0.05);
  EXPECT_EQ(senses.sightings()[0].frames, 1);
  // The suitcase is not in the occupancy layer, so that the laser sees floor up to its range.
  EXPECT_TRUE(Covers(seen->free_space, {1.1, 3.0}));
  EXPECT_TRUE(Covers(seen->free_space, {4.9, 3.0}));
  EXPECT_FALSE(Covers(seen->free_space, {5.1, 3.0}));
  EXPECT_FALSE(Covers(seen->free_space, {1.5, 5.0})) << "beside what the camera sees";
}

TEST_F(SensesTest, TheSameSeedSeesTheSame) {
  const PlanarTransform pose(1.0, 3.0, 0.1);
  const SensesOptions options{.noisy_detector = true, .pose_error = true, .seed = 7};
  const auto see = [&](const SensesOptions& of) {
    Senses senses(*world_, site_, of);
    const PlanarTransform believed = senses.Localise(pose);
    EXPECT_NE(believed, pose);
    return *senses.Observe(pose, believed);
  };
  const Observation a = see(options), b = see(options);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.free_space, b.free_space);
  EXPECT_EQ(a.detections, b.detections);
  EXPECT_NE(a.depth, see({.noisy_detector = true, .pose_error = true, .seed = 8}).depth);
}

TEST_F(SensesTest, WhatIsSeenLiesWhereTheRobotBelievesToBe) {
  Senses senses(*world_, nullptr, {.pose_error = true, .range_m = 4.0});
  const PlanarTransform pose(1.0, 3.0, 0.0), believed(1.1, 3.05, 0.0);
  const absl::StatusOr<Observation> seen = senses.Observe(pose, believed);
  ASSERT_TRUE(seen.ok()) << seen.status();
  EXPECT_NEAR(seen->free_space.bounds().min.x, 1.1, 1e-9);
  EXPECT_NEAR(seen->free_space.bounds().max.x, 5.1, 1e-3);
  ASSERT_EQ(seen->detections.size(), 1u);
  EXPECT_NEAR(Centroid(seen->detections[0].hull).y, 3.05, 0.05);
}

}  // namespace
}  // namespace hypermap::robots
