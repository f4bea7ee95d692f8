#include "client_libs/ros2/conversion/masks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "map/geometry/predicates.h"
#include "tests/support/random_map.h"

namespace hypermap::ros2 {
namespace {

LayerSpec Floor(const PlanarTransform& origin) {
  LayerSpec spec;
  spec.name = "floor";
  spec.kind = LayerKind::kOccupancy;
  spec.frame_id = "map";
  spec.grid = GridGeometry{origin, 0.1};
  return spec;
}

LayerSpec Zones() {
  LayerSpec spec;
  spec.name = "zones";
  spec.frame_id = "zones";
  return spec;
}

SemanticObject Zone(const Shape& shape, double limit_m_s) {
  SemanticObject zone;
  zone.label = "zone";
  zone.tags = {"keep out"};
  zone.shape = shape;
  zone.attributes[kSpeedLimitAttribute] = limit_m_s;
  return zone;
}

// Cell by cell, by the predicate of a point in a polygon.
TEST(MasksTest, MasksEqualBruteForce) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  for (int i = 0; i < 10; ++i) {
    const PlanarTransform map_from_zones = testing::RandomTransform(rng, 1.0);
    EditBatch batch{
        {CreateLayer{Floor(testing::RandomTransform(rng, 1.0))}, CreateLayer{Zones()},
         SetTransform{{"map", "zones", map_from_zones}},
         WriteCells{"floor", {-40, 40, -40, 40}, std::vector<std::optional<double>>(6400, 0.0)}}};
    std::vector<Polygon> areas;
    for (int zone = 0; zone < 4; ++zone) {
      areas.push_back(testing::RandomPolygon(rng, {testing::Uniform(rng, -3, 3), 0.5}, 2.0));
      batch.edits.push_back(PutObject{"zones", Zone(areas.back(), 0.25 * (zone + 1)), ""});
    }
    batch.edits.push_back(
        PutObject{"zones", Zone(Shape::MakePointUnchecked({0, 0}), 0.01), ""});  // no area
    const Snapshot map = testing::MakeSnapshot("site", batch);
    const GridLayer& floor = *map.FindGrid("floor");
    const ValueQuery value = *ParseValueQuery("tag:keep out");
    const Mask keep_out = KeepOutMask(map, floor, value, absl::UnixEpoch());
    const Mask speed = SpeedMask(map, floor, value, absl::UnixEpoch());
    EXPECT_EQ(speed.info.multiplier, 0.01F);
    size_t cell = 0;
    for (int32_t row = -40; row < 40; ++row) {
      for (int32_t col = -40; col < 40; ++col, ++cell) {
        const Point centre = floor.geometry().CentreOf({row, col});
        int lowest = 0;
        for (int zone = 3; zone >= 0; --zone) {
          if (Covers(map_from_zones * areas[zone], centre)) lowest = 25 * (zone + 1);
        }
        EXPECT_EQ(keep_out.grid.data[cell], lowest > 0 ? 100 : 0) << row << ", " << col;
        EXPECT_EQ(speed.grid.data[cell], lowest) << row << ", " << col;
      }
    }
  }
}

}  // namespace
}  // namespace hypermap::ros2
