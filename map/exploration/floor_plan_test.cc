#include "map/exploration/floor_plan.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"
#include "map/layers/layer_registry.h"

namespace hypermap {
namespace {

using testing::RandomCells;
using testing::RandomFloor;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

std::shared_ptr<const GridLayer> Occupancy(const CellBox& box,
                                           const std::vector<std::optional<double>>& values) {
  GridWriter writer(std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(
      {.name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "map", .grid = GridGeometry{}})));
  EXPECT_TRUE(writer.Write(box, values).ok());
  return std::move(writer).Finish().layer;
}

Floor FloorOf(const GridLayer& grid, const CellIndex& cell) {
  const std::optional<double> value = grid.ValueAt(cell);
  const OccupancyThresholds& thresholds = grid.spec().thresholds;
  if (!value) return Floor::kUnknown;
  if (*value < thresholds.free_below) return Floor::kFree;
  return *value > thresholds.occupied_above ? Floor::kOccupied : Floor::kUnknown;
}

TEST(FloorPlanTest, IsReadByTheThresholdsOfItsLayer) {
  const auto grid = Occupancy({0, 1, 0, 4}, {0.0, 0.5, 1.0, std::nullopt});
  const FloorPlan plan = ReadFloorPlan(*grid, {0, 1, -1, 5});
  EXPECT_THAT(plan.values(),
              ::testing::ElementsAre(Floor::kUnknown, Floor::kFree, Floor::kUnknown,
                                     Floor::kOccupied, Floor::kUnknown, Floor::kUnknown));
  EXPECT_EQ(plan.at({7, 7}), Floor::kUnknown);
}

TEST(FloorPlanTest, SaysWhatChanged) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const CellBox all{-140, 150, -20, 160};
  auto grid = Occupancy(all, RandomCells(rng, LayerKind::kOccupancy, all));
  const CellBox box{-200, 120, 0, 200};
  FloorPlan plan = ReadFloorPlan(*grid, box);
  for (int round = 0; round < 20; ++round) {
    const int32_t row = UniformInt(rng, -150, 140), col = UniformInt(rng, -30, 150);
    const CellBox part{row, row + UniformInt(rng, 1, 20), col, col + UniformInt(rng, 1, 20)};
    GridWriter writer(grid);
    ASSERT_TRUE(writer.Write(part, RandomCells(rng, LayerKind::kOccupancy, part)).ok());
    grid = std::move(writer).Finish().layer;
    const FloorPlan before = plan;
    std::set<CellIndex> expected;
    for (size_t i = 0; i < plan.values().size(); ++i) {
      const CellIndex cell = plan.CellOf(i);
      if (before.at(cell) != FloorOf(*grid, cell)) expected.insert(cell);
    }
    EXPECT_EQ(CountFloorChanges(*grid, part, plan), static_cast<int64_t>(expected.size()));
    std::set<CellIndex> changed;
    for (const FloorChange& change : UpdateFloorPlan(*grid, part, &plan)) {
      EXPECT_TRUE(changed.insert(change.cell).second);
      EXPECT_EQ(change.before, before.at(change.cell));
    }
    EXPECT_EQ(changed, expected);
    EXPECT_EQ(plan.values(), ReadFloorPlan(*grid, box).values());
  }
}

TEST(FloorPlanTest, AnUpdateVisitsOnlyTheTilesOfItsPart) {
  // Each tile is a look.
  const auto looks_at_grid_of = [](int32_t tiles_wide) {
    const CellBox box{0, 3 * kTileSide, 0, tiles_wide * kTileSide};
    const auto grid = Occupancy(
        box, std::vector<std::optional<double>>(static_cast<size_t>(box.num_cells()), 0.0));
    FloorPlan plan(box, Floor::kUnknown);
    const CancelledAfter never(1'000);
    const CellBox part{kTileSide + 1, kTileSide + 2, kTileSide - 1, kTileSide + 1};
    EXPECT_EQ(UpdateFloorPlan(*grid, part, &plan).size(), 2u);
    return never.num_looks();
  };
  EXPECT_EQ(looks_at_grid_of(12), looks_at_grid_of(2));
}

bool IsClearByHand(const FloorPlan& plan, const CellIndex& cell, double radius) {
  for (size_t i = 0; i < plan.values().size(); ++i) {
    if (plan.values()[i] == Floor::kFree) continue;
    const CellIndex other = plan.CellOf(i);
    if (other == cell || std::hypot(other.row - cell.row, other.col - cell.col) < radius) {
      return false;
    }
  }
  return true;
}

TEST(ClearanceTest, EqualsBruteForceThroughChanges) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (const double radius : {0.0, 0.7, 1.0, 2.0, 3.3, 5.0}) {
    FloorPlan plan = RandomFloor(rng, 24, 0.03);
    Clearance clearance(plan, radius * 0.05, 0.05);
    for (int round = 0; round < 6; ++round) {
      for (size_t i = 0; i < plan.values().size(); ++i) {
        const CellIndex cell = plan.CellOf(i);
        // Rounding may matter if the radius is a whole number of cells.
        ASSERT_EQ(clearance.IsClear(cell), IsClearByHand(plan, cell, radius - 1e-9))
            << cell.row << " " << cell.col << " radius " << radius;
      }
      const CellIndex cell = plan.CellOf(UniformInt(rng, 0, plan.values().size() - 1));
      const bool free = plan.at(cell) != Floor::kFree;
      plan.set(cell, free ? Floor::kFree : Floor::kOccupied);
      clearance.SetFree(cell, free);
    }
  }
}

TEST(ClearanceTest, KnowsTheSizeOfItsDisc) {
  const FloorPlan plan = testing::DrawnFloor({"."});
  for (const double radius : {0.0, 0.7, 1.5, 3.3, 20.1}) {
    int64_t cells = 0;
    std::set<int32_t> rows;
    for (int32_t row = -21; row <= 21; ++row) {
      for (int32_t col = -21; col <= 21; ++col) {
        if ((row != 0 || col != 0) && std::hypot(row, col) >= radius) continue;
        ++cells;
        rows.insert(row);
      }
    }
    const Clearance clearance(plan, radius * 0.05, 0.05);
    EXPECT_EQ(clearance.disc_cells(), cells) << radius;
    EXPECT_EQ(clearance.disc_rows(), static_cast<int64_t>(rows.size())) << radius;
  }
}

TEST(ClearanceTest, IsNotClearOutOfThePlan) {
  const FloorPlan plan = testing::DrawnFloor({"...", "..."});
  const Clearance clearance(plan, 0.1, 0.05);
  EXPECT_TRUE(clearance.IsClear({0, 0}));
  EXPECT_FALSE(clearance.IsClear({-1, 0}));
  EXPECT_FALSE(clearance.IsClear({0, 3}));
}

}  // namespace
}  // namespace hypermap
