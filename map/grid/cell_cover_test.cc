#include "map/grid/cell_cover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "tests/support/not_finite.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using hypermap::testing::kNan;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::RandomPolygon;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

constexpr CellRule kRules[] = {CellRule::kCentre, CellRule::kCovered, CellRule::kTouched};

// The oracle: the predicate of the rule, cell by cell, in the layer's frame.
ColumnSpans BruteForce(const Polygon& polygon, const GridGeometry& geometry, const CellBox& within,
                       CellRule rule, int32_t row) {
  const PreparedPolygon prepared(polygon);
  ColumnSpans spans;
  for (int32_t col = within.col_begin; col < within.col_end; ++col) {
    const CellIndex cell{row, col};
    const bool selected = rule == CellRule::kCentre ? Covers(polygon, geometry.CentreOf(cell))
                          : rule == CellRule::kCovered
                              ? prepared.Covers(geometry.SquareOf(cell))
                              : prepared.Intersects(geometry.SquareOf(cell));
    if (!selected) continue;
    if (!spans.empty() && spans.back().col_end == col) {
      ++spans.back().col_end;
    } else {
      spans.push_back({col, col + 1});
    }
  }
  return spans;
}

std::string ToString(const Polygon& polygon) {
  std::string text;
  char buffer[80];
  for (const Ring& ring : polygon.rings()) {
    for (const Point& p : ring) {
      std::snprintf(buffer, sizeof buffer, "(%.17g %.17g) ", p.x, p.y);
      text += buffer;
    }
    text += "; ";
  }
  return text;
}

int64_t ExpectAsBruteForce(const Polygon& polygon, const GridGeometry& geometry,
                           const CellBox& within, CellRule rule) {
  const CellCover cover(polygon, geometry, within, rule);
  EXPECT_TRUE(within.Contains(cover.bounds()));
  int64_t selected = 0;
  for (int32_t row = within.row_begin; row < within.row_end; ++row) {
    const auto spans = BruteForce(polygon, geometry, within, rule, row);
    EXPECT_EQ(cover.SpansOfRow(row), spans)
        << "row " << row << " rule " << static_cast<int>(rule) << " yaw "
        << geometry.layer_from_grid.yaw() << " " << ToString(polygon);
    for (const ColumnSpan& span : spans) {
      selected += span.col_end - span.col_begin;
      EXPECT_TRUE(cover.bounds().Contains(CellBox{row, row + 1, span.col_begin, span.col_end}));
    }
  }
  return selected;
}

// Returns the cells around a polygon, sometimes only a part of them.
CellBox Surroundings(Rng& rng, const Polygon& polygon, const GridGeometry& geometry) {
  const Box& b = polygon.bounds();
  CellBox cells;
  for (const Point& p : {b.min, b.max, Point{b.min.x, b.max.y}, Point{b.max.x, b.min.y}}) {
    const CellIndex c = *geometry.CellAt(p);
    cells = cells.Union({c.row - 2, c.row + 3, c.col - 2, c.col + 3});
  }
  if (UniformInt(rng, 0, 3) == 0) {
    cells.row_begin += UniformInt(rng, 0, 8);
    cells.col_begin += UniformInt(rng, 0, 8);
    cells.col_end -= UniformInt(rng, 0, 8);
  }
  return cells;
}

void ExpectAllRulesAsBruteForce(Rng& rng, const Polygon& polygon, const GridGeometry& geometry) {
  const CellBox within = Surroundings(rng, polygon, geometry);
  int64_t selected[3];
  for (const CellRule rule : kRules) {
    selected[static_cast<int>(rule)] = ExpectAsBruteForce(polygon, geometry, within, rule);
  }
  EXPECT_LE(selected[1], selected[0]);
  EXPECT_LE(selected[0], selected[2]);
}

TEST(CellCoverTest, AgreesWithBruteForceOnPlainGrids) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const GridGeometry office{PlanarTransform(-15.4, -12.2, 0), 0.05};
  for (int i = 0; i < 60 && !::testing::Test::HasFailure(); ++i) {
    const Point centre{Uniform(rng, -15, 15), Uniform(rng, -12, 12)};
    const double snaps[] = {0.0, 0.05, 0.025};
    ExpectAllRulesAsBruteForce(rng, RandomPolygon(rng, centre, 0.8, snaps[i % 3]), office);
  }
}

// Resolution and coordinates have few bits, so that vertices and edges fall on centres and corners.
TEST(CellCoverTest, AgreesWithBruteForceWhereBoundariesMeetCells) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 150 && !::testing::Test::HasFailure(); ++i) {
    const GridGeometry geometry{PlanarTransform(UniformInt(rng, -9, 9), -3.5, 0), 0.5};
    ExpectAllRulesAsBruteForce(rng, RandomPolygon(rng, {1, 2}, 5.0, 0.25), geometry);
  }
}

TEST(CellCoverTest, AgreesWithBruteForceOnTurnedGrids) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 90 && !::testing::Test::HasFailure(); ++i) {
    // Quarter turns bring edges back onto centres and corners, now with rounding.
    const double yaw = i % 3 == 0 ? Uniform(rng, -3, 3) : std::numbers::pi / 2 * (i % 3);
    const GridGeometry geometry{PlanarTransform(-15.4, 7.1, yaw), 0.05};
    const Point centre{Uniform(rng, -15, 15), Uniform(rng, -12, 12)};
    ExpectAllRulesAsBruteForce(rng, RandomPolygon(rng, centre, 0.6, i % 2 ? 0.025 : 0), geometry);
  }
}

// The vertices are corners and centres of the rotated cells themselves.
TEST(CellCoverTest, AgreesWithBruteForceOnPolygonsMadeOfTurnedCells) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 40 && !::testing::Test::HasFailure(); ++i) {
    const GridGeometry geometry{PlanarTransform(3, -2, Uniform(rng, -3, 3)), 0.1};
    const Polygon in_grid = RandomPolygon(rng, {1, 1}, 0.9, i % 2 ? 0.05 : 0.1);
    ExpectAllRulesAsBruteForce(rng, geometry.layer_from_grid * in_grid, geometry);
  }
}

// Returns a polygon with a bay and a hole, with edges on centres of cells and between them.
Polygon RandomRectilinear(Rng& rng) {
  const auto place = [&rng](double low, double high) {
    const double at = Uniform(rng, low, high);
    return UniformInt(rng, 0, 1) == 0 ? at : std::round(at * 4) / 4;
  };
  const double x[] = {place(-9, -8), place(-4, -3), place(3, 4), place(8, 9)};
  const double y[] = {place(-9, -8), place(-4, -3), place(3, 4), place(8, 9)};
  const double bay = place(-2, 2);
  Rings rings = {{{x[0], y[0]},
                  {x[3], y[0]},
                  {x[3], y[3]},
                  {x[2], y[3]},
                  {x[2], y[2]},
                  {bay, y[2]},
                  {bay, y[3]},
                  {x[0], y[3]}}};
  if (UniformInt(rng, 0, 1) == 0) {
    rings.push_back({{x[1], y[1]}, {x[1], 0}, {x[2], 0}, {x[2], y[1]}});
  }
  return Polygon::MakeUnchecked(std::move(rings));
}

TEST(CellCoverTest, RectilinearPolygonsAgreeWithBruteForce) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 60 && !::testing::Test::HasFailure(); ++i) {
    const GridGeometry geometry{PlanarTransform(UniformInt(rng, -9, 9), -3.5, 0), 0.5};
    ExpectAllRulesAsBruteForce(rng, RandomRectilinear(rng), geometry);
  }
}

TEST(CellCoverTest, LikeRowsHaveTheSameSpans) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 300 && !::testing::Test::HasFailure(); ++i) {
    const Polygon polygon =
        i % 3 == 0 ? RandomPolygon(rng, {0, 0}, 8, i % 2 ? 0.25 : 0) : RandomRectilinear(rng);
    const double yaw = i % 10 == 0 ? std::numbers::pi / 2 : 0;
    const GridGeometry geometry{PlanarTransform(0.25, -3.5, yaw), i % 2 ? 0.5 : 0.05};
    const CellBox within = Surroundings(rng, polygon, geometry);
    const CellCover cover(polygon, geometry, within, kRules[UniformInt(rng, 0, 2)]);
    for (int32_t row = within.row_begin; row < within.row_end;) {
      const int32_t end = cover.EndOfLikeRows(row);
      ASSERT_GT(end, row);
      const ColumnSpans spans = cover.SpansOfRow(row);
      for (++row; row < std::min(end, within.row_end); ++row) {
        ASSERT_EQ(cover.SpansOfRow(row), spans) << "row " << row << " " << ToString(polygon);
      }
    }
  }
}

TEST(CellCoverTest, RowsOfABoxAreLikeButForItsEnds) {
  const GridGeometry geometry{PlanarTransform(), 0.05};
  const CellCover cover(Polygon::FromBox({{1.01, 2.01}, {3.01, 4.01}}), geometry, kAllCells);
  EXPECT_GE(cover.EndOfLikeRows(41), 78);
  EXPECT_LE(cover.EndOfLikeRows(41), 80);
}

TEST(CellCoverTest, CentresOnTheBoundaryAreSelected) {
  const GridGeometry geometry{PlanarTransform(), 1.0};
  const Polygon square = Polygon::FromBox({{0.5, 0.5}, {2.5, 2.5}});
  const CellCover centres(square, geometry, kAllCells, CellRule::kCentre);
  EXPECT_THAT(centres.SpansOfRow(0), ElementsAre(ColumnSpan{0, 3}));
  EXPECT_THAT(centres.SpansOfRow(2), ElementsAre(ColumnSpan{0, 3}));
  EXPECT_THAT(centres.SpansOfRow(3), IsEmpty());
  const CellCover covered(square, geometry, kAllCells, CellRule::kCovered);
  EXPECT_THAT(covered.SpansOfRow(0), IsEmpty());
  EXPECT_THAT(covered.SpansOfRow(1), ElementsAre(ColumnSpan{1, 2}));
}

TEST(CellCoverTest, SquaresThatMeetTheBoundaryAreTouchedAndCoveredFromInside) {
  const GridGeometry geometry{PlanarTransform(), 1.0};
  const Polygon square = Polygon::FromBox({{1, 1}, {3, 3}});
  const CellCover touched(square, geometry, kAllCells, CellRule::kTouched);
  EXPECT_THAT(touched.SpansOfRow(-1), IsEmpty());
  EXPECT_THAT(touched.SpansOfRow(0), ElementsAre(ColumnSpan{0, 4}));
  EXPECT_THAT(touched.SpansOfRow(3), ElementsAre(ColumnSpan{0, 4}));
  const CellCover covered(square, geometry, kAllCells, CellRule::kCovered);
  EXPECT_THAT(covered.SpansOfRow(0), IsEmpty());
  EXPECT_THAT(covered.SpansOfRow(1), ElementsAre(ColumnSpan{1, 3}));
}

TEST(CellCoverTest, OnlyCellsWithinTheBoxAreSelected) {
  const GridGeometry geometry{PlanarTransform(), 1.0};
  const Polygon square = Polygon::FromBox({{-100, -100}, {100, 100}});
  const CellCover cover(square, geometry, {2, 4, 5, 9});
  EXPECT_EQ(cover.bounds(), (CellBox{2, 4, 5, 9}));
  EXPECT_THAT(cover.SpansOfRow(1), IsEmpty());
  EXPECT_THAT(cover.SpansOfRow(3), ElementsAre(ColumnSpan{5, 9}));
  EXPECT_TRUE(CellCover(square, geometry, {500, 600, 0, 10}).bounds().empty());
  EXPECT_TRUE(CellCover(square, geometry, CellBox()).bounds().empty());
  EXPECT_TRUE(CellCover(Polygon(), geometry, kAllCells).bounds().empty());
}

// Rows have millions of cells; visiting each would take minutes.
TEST(CellCoverTest, RowsCostEdgesNotCells) {
  const GridGeometry plain{PlanarTransform(), 1.0};
  const GridGeometry turned{PlanarTransform(0, 0, std::numbers::pi / 4), 1.0};
  const Polygon square = Polygon::FromBox({{-2e6, -2e6}, {2e6, 2e6}});
  for (const GridGeometry& geometry : {plain, turned}) {
    for (const CellRule rule : kRules) {
      const CellCover cover(square, geometry, kAllCells, rule);
      for (int32_t row = -5000; row < 5000; ++row) {
        const auto spans = cover.SpansOfRow(row);
        ASSERT_EQ(spans.size(), 1u);
        ASSERT_GE(spans[0].col_end - spans[0].col_begin, 3999998);
      }
    }
  }
}

TEST(CellCoverTest, CoordinatesOutOfAllProportionSelectWithoutTrouble) {
  const Polygon huge = Polygon::FromBox({{-1e300, -1e300}, {1e300, 1e300}});
  const Polygon far = Polygon::FromBox({{1e300, 1e300}, {2e300, 2e300}});
  for (const double yaw : {0.0, 1.0}) {
    const GridGeometry geometry{PlanarTransform(0, 0, yaw), 0.05};
    for (const CellRule rule : kRules) {
      EXPECT_THAT(CellCover(far, geometry, kAllCells, rule).SpansOfRow(0), IsEmpty());
      if (yaw != 0.0) continue;
      EXPECT_THAT(CellCover(huge, geometry, kAllCells, rule).SpansOfRow(0),
                  ElementsAre(ColumnSpan{-kMaxCellIndex, kMaxCellIndex}));
    }
  }
}

// Areas and grids that can't be in a map. None makes a cast undefined, or a row without end.
TEST(CellCoverTest, AnyDoubleIsSafe) {
  const double inf = std::numeric_limits<double>::infinity();
  const double values[] = {kNan, inf, -inf, 1e308, -1e308, 1.7e308, 0.0};
  const CellBox within{-100, 100, -50, 50};
  for (const double x : values) {
    for (const double y : values) {
      // In turn as the area's vertex, as a vertex of its hole, and as the origin of the grid.
      const Polygon corner = Polygon::MakeUnchecked({{{0, 0}, {5, 0}, {x, y}}});
      const Polygon away = Polygon::MakeUnchecked({{{x, y}, {x, y}, {x, y}}});
      const Polygon hole =
          Polygon::MakeUnchecked({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{1, 1}, {1, 2}, {x, y}}});
      const Polygon square = Polygon::FromBox({{-1e9, -1e9}, {1e9, 1e9}});
      for (const double yaw : {0.0, 0.5}) {
        const GridGeometry near{PlanarTransform(0.1, 0.2, yaw), 0.05};
        const GridGeometry far{PlanarTransform(x, y, yaw), 1e-4};
        for (const CellRule rule : kRules) {
          for (const CellCover& cover :
               {CellCover(corner, near, within, rule), CellCover(away, near, within, rule),
                CellCover(hole, near, within, rule), CellCover(square, far, within, rule)}) {
            const CellBox& bounds = cover.bounds();
            ASSERT_TRUE(within.Contains(bounds)) << x << " " << y;
            for (int32_t row = bounds.row_begin; row < bounds.row_end; ++row) {
              for (const ColumnSpan& span : cover.SpansOfRow(row)) {
                ASSERT_LT(span.col_begin, span.col_end);
                ASSERT_TRUE(bounds.Contains({row, row + 1, span.col_begin, span.col_end}));
              }
              ASSERT_GT(cover.EndOfLikeRows(row), row);
            }
          }
        }
      }
    }
  }
}

TEST(CellCoverTest, AreaThatIsNoNumberSelectsNoCell) {
  const Polygon nowhere = Polygon::MakeUnchecked({{{kNan, kNan}, {kNan, kNan}, {kNan, kNan}}});
  // The position of this grid's cells in an area is the difference of two infinite numbers.
  const GridGeometry far{PlanarTransform(1.7e308, -1.7e308, 0.5), 0.05};
  const GridGeometry near{PlanarTransform(0, 0, 0.5), 0.05};
  const Polygon square = Polygon::FromBox({{-1e9, -1e9}, {1e9, 1e9}});
  EXPECT_TRUE(CellCover(nowhere, near, kAllCells).bounds().empty());
  EXPECT_TRUE(CellCover::BoundsOf(nowhere, near, kAllCells).empty());
  EXPECT_TRUE(CellCover(square, far, kAllCells).bounds().empty());
}

}  // namespace
}  // namespace hypermap
