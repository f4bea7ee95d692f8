// Writing of many cells, and of what they may take.
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;
using testing::RandomCells;
using testing::RandomPolygon;
using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

constexpr int64_t kCellsAtMost = int64_t{1} << 26;

std::shared_ptr<const GridLayer> EmptyScalars(const GridGeometry& geometry) {
  return std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(
      {.name = "grid", .kind = LayerKind::kScalar, .frame_id = "map", .grid = geometry}));
}

using CellModel = std::map<CellIndex, std::optional<double>>;

void ExpectCells(const GridLayer& grid, const CellModel& expected) {
  const CellBox& box = grid.extent();
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      const auto cell = expected.find({row, col});
      ASSERT_EQ(grid.ValueAt({row, col}), cell == expected.end() ? std::nullopt : cell->second)
          << row << ", " << col;
    }
  }
  for (const auto& [cell, value] : expected) ASSERT_TRUE(box.Contains(cell));
}

TEST(GridWriterTest, FillsAndWritesOfManyTilesSetTheirCells) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 2; ++i) {
    const GridGeometry geometry{i % 2 ? RandomTransform(rng, 5) : PlanarTransform(), 0.1};
    auto grid = EmptyScalars(geometry);
    CellModel cells;
    for (int commit = 0; commit < 2; ++commit) {
      GridWriter writer(grid);
      for (int edit = 0; edit < 4; ++edit) {
        const Point centre{Uniform(rng, -10, 10), Uniform(rng, -10, 10)};
        const Polygon area = RandomPolygon(rng, centre, Uniform(rng, 1, 24), edit % 2 ? 0.05 : 0);
        const std::optional<double> value =
            UniformInt(rng, 0, 3) == 0 ? std::nullopt : std::optional<double>(edit);
        ASSERT_TRUE(writer.Fill(area, CellRule::kCentre, value, kCellsAtMost).ok());
        const Box bounds = BoundsOf(geometry.layer_from_grid.Inverse(), area.bounds());
        for (auto row = static_cast<int32_t>(bounds.min.y / 0.1) - 2; row < bounds.max.y / 0.1 + 2;
             ++row) {
          for (auto col = static_cast<int32_t>(bounds.min.x / 0.1) - 2;
               col < bounds.max.x / 0.1 + 2; ++col) {
            if (Covers(area, geometry.CentreOf({row, col}))) cells[{row, col}] = value;
          }
        }
        const int32_t row = UniformInt(rng, -200, 100);
        const int32_t col = UniformInt(rng, -200, 100);
        const CellBox box{row, row + UniformInt(rng, 1, 200), col, col + UniformInt(rng, 1, 200)};
        const auto values = RandomCells(rng, LayerKind::kScalar, box);
        ASSERT_TRUE(writer.Write(box, values).ok());
        size_t next = 0;
        for (int32_t r = box.row_begin; r < box.row_end; ++r) {
          for (int32_t c = box.col_begin; c < box.col_end; ++c) cells[{r, c}] = values[next++];
        }
      }
      grid = std::move(writer).Finish().layer;
      for (auto& [cell, value] : cells) {
        // As 32-bit floats.
        if (value) value = static_cast<float>(*value);
      }
      ExpectCells(*grid, cells);
    }
  }
}

TEST(GridWriterTest, WholeTilesKeepTheSignOfZero) {
  GridWriter writer(EmptyScalars({PlanarTransform(), 1.0}));
  const Polygon area = Polygon::FromBox({{0, 0}, {300, 300}});
  ASSERT_TRUE(writer.Fill(area, CellRule::kCentre, 0.0, kCellsAtMost).ok());
  ASSERT_TRUE(writer.Fill(area, CellRule::kCentre, -0.0, kCellsAtMost).ok());
  const auto grid = std::move(writer).Finish().layer;
  for (const CellIndex& cell : {CellIndex{5, 5}, CellIndex{299, 299}}) {
    ASSERT_TRUE(grid->ValueAt(cell).has_value());
    EXPECT_TRUE(std::signbit(*grid->ValueAt(cell)));
  }
}

TEST(GridWriterTest, TilesThatBecomeAsBeforeAreNotWritten) {
  GridWriter first(EmptyScalars({PlanarTransform(), 1.0}));
  const Polygon area = Polygon::FromBox({{0, 0}, {200, 200}});
  ASSERT_TRUE(first.Fill(area, CellRule::kCentre, 1.0, kCellsAtMost).ok());
  const auto before = std::move(first).Finish().layer;
  GridWriter second(before);
  ASSERT_TRUE(second.Fill(area, CellRule::kCentre, 2.0, kCellsAtMost).ok());
  // Elsewhere, where nothing was known.
  const Polygon other = Polygon::FromBox({{1000, 0}, {1300, 300}});
  ASSERT_TRUE(second.Fill(other, CellRule::kCentre, 2.0, kCellsAtMost).ok());
  EXPECT_NE(second.growth(), 0);
  ASSERT_TRUE(second.Fill(other, CellRule::kCentre, std::nullopt, kCellsAtMost).ok());
  ASSERT_TRUE(second.Fill(area, CellRule::kCentre, 1.0, kCellsAtMost).ok());
  const auto result = std::move(second).Finish();
  EXPECT_TRUE(result.written.empty());
  EXPECT_EQ(result.layer->tiles().size(), before->tiles().size());
  EXPECT_EQ(result.layer->ByteSize(), before->ByteSize());
}

// A comb with its spine on the left, and teeth of 1 m that are 1 m apart.
Polygon Comb(double width_m, int num_teeth) {
  Ring ring{{0, 0}, {width_m, 0}};
  for (int i = 1; i < num_teeth; ++i) {
    const double y = 2.0 * i - 1.0;
    ring.insert(ring.end(), {{width_m, y}, {1, y}, {1, y + 1}, {width_m, y + 1}});
  }
  ring.push_back({width_m, 2.0 * num_teeth - 1.0});
  ring.push_back({0, 2.0 * num_teeth - 1.0});
  return *Polygon::Make(ring);
}

TEST(GridWriterTest, TilesArePackedBeforeTheNextAreUnpacked) {
  // 8 x 100 tiles, all of which have two codes.
  GridWriter writer(EmptyScalars({PlanarTransform(), 1.0}));
  ASSERT_TRUE(
      writer.Fill(Comb(100 * kTileSide, 8 * kTileSide / 2), CellRule::kCentre, 1.0, kCellsAtMost)
          .ok());
  // More than half of them are packed already.
  EXPECT_GT(writer.growth(), 8 * 100 / 2 * int64_t{kCellsPerTile});
  const auto grid = std::move(writer).Finish().layer;
  EXPECT_EQ(grid->tiles().size(), 8u * 100);
  EXPECT_GT(grid->ByteSize(), 8 * 100 * int64_t{kCellsPerTile});
  EXPECT_LT(grid->ByteSize(), 8 * 100 * 5 / 4 * int64_t{kCellsPerTile});
  EXPECT_EQ(grid->ValueAt({0, 70}), 1.0);
  EXPECT_EQ(grid->ValueAt({1, 70}), std::nullopt);
}

TEST(GridWriterTest, FillBeyondItsGrowthEndsEarlyAndNamesTheLimit) {
  GridWriter writer(EmptyScalars({PlanarTransform(), 1.0}));
  writer.LimitGrowth(1'000'000);
  const Polygon comb = Comb(60 * kTileSide, 60 * kTileSide / 2);
  const absl::Status refused = writer.Fill(comb, CellRule::kCentre, 1.0, kCellsAtMost);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("the 1000000 bytes of memory by which --max_content_bytes lets"));
  // The 3600 tiles would take 60 MB. Only those that are unpacked at a time were made.
  EXPECT_LT(writer.growth(), 20'000'000);
}

TEST(GridWriterTest, UniformTilesFitIntoLittleGrowth) {
  GridWriter writer(EmptyScalars({PlanarTransform(), 1.0}));
  writer.LimitGrowth(1'000'000);
  const Polygon area = Polygon::FromBox({{0, 0}, {60.0 * kTileSide, 60.0 * kTileSide}});
  EXPECT_TRUE(writer.Fill(area, CellRule::kCentre, 1.0, kCellsAtMost).ok());
  EXPECT_EQ(std::move(writer).Finish().layer->tiles().size(), 60u * 60);
}

TEST(GridWriterTest, FillThatShrinksNeedsNoGrowth) {
  GridWriter first(EmptyScalars({PlanarTransform(), 1.0}));
  const double side = 16.0 * kTileSide;
  ASSERT_TRUE(first.Fill(Comb(side, 8 * kTileSide), CellRule::kCentre, 1.0, kCellsAtMost).ok());
  const auto before = std::move(first).Finish().layer;
  GridWriter second(before);
  second.LimitGrowth(0);
  ASSERT_TRUE(second
                  .Fill(Polygon::FromBox({{0, 0}, {side, side}}), CellRule::kCentre, std::nullopt,
                        kCellsAtMost)
                  .ok());
  ASSERT_TRUE(second.Write({0, 1, 0, 1}, {std::nullopt}).ok());
  const auto after = std::move(second).Finish().layer;
  EXPECT_LT(after->ByteSize(), before->ByteSize() / 50);
  EXPECT_EQ(after->ValueAt({0, 0}), std::nullopt);
}

}  // namespace
}  // namespace hypermap
