#include "client_libs/ros2/conversion/grids.h"

#include <gtest/gtest.h>

#include <cmath>

#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap::ros2 {
namespace {

std::shared_ptr<const GridLayer> MakeGrid(LayerKind kind, const PlanarTransform& origin = {}) {
  LayerSpec spec;
  spec.name = "floor";
  spec.kind = kind;
  spec.frame_id = "map";
  spec.grid = GridGeometry{origin, 0.5};
  return std::make_shared<const GridLayer>(spec, MakeCellDomain(spec));
}

std::shared_ptr<const GridLayer> Written(std::shared_ptr<const GridLayer> layer, const CellBox& box,
                                         const std::vector<std::optional<double>>& values) {
  GridWriter writer(std::move(layer));
  EXPECT_TRUE(writer.Write(box, values).ok());
  return std::move(writer).Finish().layer;
}

TEST(GridsTest, CellsAreBytesRowByRowFromTheLowestOne) {
  const auto layer = Written(MakeGrid(LayerKind::kOccupancy), {-1, 1, 2, 5},
                             {0.0, 0.4, 1.0, std::nullopt, 0.1, 0.9});
  const auto trinary = ToOccupancyGrid(*layer, GridMode::kTrinary, absl::FromUnixMillis(1'500));
  EXPECT_EQ(trinary.data, (std::vector<int8_t>{0, -1, 100, -1, 0, 100}));
  EXPECT_EQ(trinary.info.width, 3U);
  EXPECT_EQ(trinary.info.height, 2U);
  EXPECT_EQ(trinary.info.origin.position.x, 1.0);
  EXPECT_EQ(trinary.info.origin.position.y, -0.5);
  EXPECT_EQ(trinary.header.frame_id, "map");
  EXPECT_EQ(trinary.header.stamp.sec, 1);
  EXPECT_EQ(trinary.header.stamp.nanosec, 500'000'000U);
  const auto scale = ToOccupancyGrid(*layer, GridMode::kScale, absl::UnixEpoch());
  EXPECT_EQ(scale.data[1], 1 + std::lround(98 * (0.4 - 0.196) / (0.65 - 0.196)));
}

TEST(GridsTest, ATurnedGridHasATurnedOrigin) {
  const auto layer =
      Written(MakeGrid(LayerKind::kOccupancy, {3.0, 4.0, M_PI / 2}), {0, 1, 2, 3}, {1.0});
  const auto grid = ToOccupancyGrid(*layer, GridMode::kTrinary, absl::UnixEpoch());
  EXPECT_NEAR(grid.info.origin.position.x, 3.0, 1e-12);
  EXPECT_NEAR(grid.info.origin.position.y, 5.0, 1e-12);
  EXPECT_NEAR(grid.info.origin.orientation.z, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(grid.info.origin.orientation.w, std::sqrt(0.5), 1e-12);
}

TEST(GridsTest, MeasurementsSpreadOverTheirOwnRange) {
  const auto layer =
      Written(MakeGrid(LayerKind::kScalar), {0, 1, 0, 4}, {-70.0, -50.0, std::nullopt, -30.0});
  const auto grid = ToOccupancyGrid(*layer, GridMode::kTrinary, absl::UnixEpoch());
  EXPECT_EQ(grid.data, (std::vector<int8_t>{0, 50, -1, 100}));
}

TEST(GridsTest, UpdatesMakeTheGridBeforeTheGridAfter) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const CellBox whole{-40, 200, -150, 90};
  auto before = Written(MakeGrid(LayerKind::kOccupancy), whole,
                        testing::RandomCells(rng, LayerKind::kOccupancy, whole));
  for (int i = 0; i < 20; ++i) {
    const int32_t row = testing::UniformInt(rng, -40, 190);
    const int32_t col = testing::UniformInt(rng, -150, 80);
    const CellBox box{row, testing::UniformInt(rng, row + 1, 200), col,
                      testing::UniformInt(rng, col + 1, 90)};
    const auto after = Written(before, box, testing::RandomCells(rng, LayerKind::kOccupancy, box));
    ASSERT_TRUE(CanUpdate(*before, *after));
    const CellBox changed = ChangedCells(*before, *after);
    EXPECT_TRUE(box.Contains(changed));
    auto grid = ToOccupancyGrid(*before, GridMode::kScale, absl::UnixEpoch());
    if (!changed.empty()) {
      const auto update = ToUpdate(*after, changed, GridMode::kScale, absl::UnixEpoch());
      for (uint32_t y = 0; y < update.height; ++y) {
        for (uint32_t x = 0; x < update.width; ++x) {
          grid.data[(update.y + y) * grid.info.width + update.x + x] =
              update.data[y * update.width + x];
        }
      }
    }
    EXPECT_EQ(grid.data, ToOccupancyGrid(*after, GridMode::kScale, absl::UnixEpoch()).data);
    before = after;
  }
}

TEST(GridsTest, AGridThatGrowsIsNotUpdated) {
  const auto before = Written(MakeGrid(LayerKind::kOccupancy), {0, 2, 0, 2}, {1.0, 1.0, 1.0, 1.0});
  const auto after = Written(before, {2, 3, 0, 1}, {1.0});
  EXPECT_FALSE(CanUpdate(*before, *after));
}

}  // namespace
}  // namespace hypermap::ros2
