#include "map/grid/distance_field.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "gtest/gtest.h"

namespace hypermap {
namespace {

const GridGeometry kTurned{.layer_from_grid = PlanarTransform(3.0, -2.0, 0.7), .resolution_m = 0.1};
constexpr CellBox kBox{-10, 20, 5, 45};

std::set<CellIndex> RandomCells(uint64_t seed, int number) {
  std::mt19937_64 random(seed);
  std::set<CellIndex> cells;
  for (int i = 0; i < number; ++i) {
    const auto row = static_cast<int32_t>(kBox.row_begin + random() % kBox.rows());
    const auto col = static_cast<int32_t>(kBox.col_begin + random() % kBox.cols());
    cells.insert({row, col});
  }
  return cells;
}

DistanceField FieldOf(const std::set<CellIndex>& cells, double reach_m) {
  return DistanceField(
      kTurned, kBox, [&](const CellIndex& cell) { return cells.contains(cell); }, reach_m);
}

TEST(DistanceFieldTest, AtCentresItIsTheDistanceToTheNearestMarkedCell) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const std::set<CellIndex> cells = RandomCells(seed, 12);
    const DistanceField field = FieldOf(cells, 0.8);
    for (int32_t row = kBox.row_begin - 7; row < kBox.row_end + 7; ++row) {
      for (int32_t col = kBox.col_begin - 7; col < kBox.col_end + 7; ++col) {
        double nearest = 0.8;
        for (const CellIndex& cell : cells) {
          nearest = std::min(nearest, 0.1 * std::hypot(row - cell.row, col - cell.col));
        }
        const Point p = kTurned.CentreOf({row, col});
        ASSERT_NEAR(field.DistanceAt({p.x, p.y}), nearest, 1e-5) << row << " " << col;
      }
    }
  }
}

TEST(DistanceFieldTest, TheGradientIsThatOfTheDistance) {
  const DistanceField field = FieldOf(RandomCells(3, 12), 0.8);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> x(0.0, 4.0), y(-3.0, 3.0);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d p(x(random), y(random));
    const DistanceField::Sample sample = field.At(p);
    EXPECT_EQ(sample.distance_m, field.DistanceAt(p));
    const Eigen::Vector2d dx(kStep, 0.0), dy(0.0, kStep);
    EXPECT_NEAR(sample.gradient.x(),
                (field.DistanceAt(p + dx) - field.DistanceAt(p - dx)) / (2 * kStep), 1e-3);
    EXPECT_NEAR(sample.gradient.y(),
                (field.DistanceAt(p + dy) - field.DistanceAt(p - dy)) / (2 * kStep), 1e-3);
  }
}

TEST(DistanceFieldTest, FarAwayAndWithoutCellsItIsTheReach) {
  EXPECT_EQ(FieldOf(RandomCells(1, 5), 0.8).DistanceAt({1000.0, 0.0}), 0.8);
  const DistanceField unmarked = FieldOf({}, 0.8);
  EXPECT_FALSE(unmarked.empty());
  EXPECT_NEAR(unmarked.DistanceAt({3.0, -2.0}), 0.8, 1e-6);
  const DistanceField empty(
      kTurned, {}, [](const CellIndex&) { return true; }, 0.8);
  EXPECT_TRUE(empty.empty());
  EXPECT_EQ(empty.DistanceAt({3.0, -2.0}), 0.8);
}

}  // namespace
}  // namespace hypermap
