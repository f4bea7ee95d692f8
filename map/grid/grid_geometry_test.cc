#include "map/grid/grid_geometry.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

const GridGeometry kOffice{PlanarTransform(-15.4, -12.2, 0), 0.05};

TEST(GridGeometryTest, CellsAreHalfOpen) {
  const GridGeometry geometry{PlanarTransform(1, 2, 0), 0.5};
  EXPECT_EQ(geometry.CellAt({1, 2}), (CellIndex{0, 0}));
  EXPECT_EQ(geometry.CellAt({1.5, 2}), (CellIndex{0, 1}));
  EXPECT_EQ(geometry.CellAt({std::nextafter(1.5, 0.0), 2.5}), (CellIndex{1, 0}));
  EXPECT_EQ(geometry.CellAt({0.99, 1.49}), (CellIndex{-2, -1}));
}

TEST(GridGeometryTest, TurnedCellsCountAlongTheirOwnAxes) {
  const GridGeometry geometry{PlanarTransform(10, 0, std::numbers::pi / 2), 1.0};
  // The grid's x axis is the layer's y axis; its y axis is the layer's negative x axis.
  EXPECT_EQ(geometry.CellAt({9.5, 3.5}), (CellIndex{0, 3}));
  EXPECT_EQ(geometry.CellAt({7.5, -0.5}), (CellIndex{2, -1}));
  EXPECT_NEAR(geometry.CentreOf({2, -1}).x, 7.5, 1e-12);
  EXPECT_NEAR(geometry.CentreOf({2, -1}).y, -0.5, 1e-12);
}

TEST(GridGeometryTest, ComputesInTheDocumentedOrderOfOperations) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 10000; ++i) {
    const CellIndex cell{UniformInt(rng, -5000, 5000), UniformInt(rng, -5000, 5000)};
    // volatile forces each step to be rounded to a double, whatever the compiler would prefer.
    const volatile double along_x = (cell.col + 0.5) * 0.05, along_y = (cell.row + 0.5) * 0.05;
    const volatile double x = -15.4 + along_x, y = -12.2 + along_y;
    EXPECT_EQ(kOffice.CentreOf(cell), (Point{x, y}));
    const Point p{Uniform(rng, -100, 100), UniformInt(rng, -4000, 4000) * 0.025};
    const volatile double dx = p.x - -15.4, dy = p.y - -12.2;
    const volatile double col = dx / 0.05, row = dy / 0.05;
    EXPECT_EQ(kOffice.CellAt(p), (CellIndex{static_cast<int32_t>(std::floor(row)),
                                            static_cast<int32_t>(std::floor(col))}));
  }
}

TEST(GridGeometryTest, ACentreLiesInItsCell) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 10000; ++i) {
    const GridGeometry geometry{RandomTransform(rng, 100), Uniform(rng, 0.01, 2)};
    const CellIndex cell{UniformInt(rng, -kMaxCellIndex, kMaxCellIndex - 1),
                         UniformInt(rng, -kMaxCellIndex, kMaxCellIndex - 1)};
    EXPECT_EQ(geometry.CellAt(geometry.CentreOf(cell)), cell);
    const CellBox box{cell.row, cell.row + 1, cell.col, cell.col + 1};
    EXPECT_TRUE(geometry.BoundsOf(box).Covers(geometry.CentreOf(cell)));
    const Polygon square = geometry.SquareOf(cell);
    for (const Point& corner : square.outer()) {
      EXPECT_TRUE(geometry.BoundsOf(box).Covers(corner));
    }
  }
}

TEST(GridGeometryTest, PlacesBeyondAllCellsHaveNone) {
  const GridGeometry geometry{PlanarTransform(), 1.0};
  EXPECT_TRUE(geometry.CellAt({kMaxCellIndex - 0.5, -kMaxCellIndex}).has_value());
  EXPECT_FALSE(geometry.CellAt({kMaxCellIndex, 0}).has_value());
  EXPECT_FALSE(geometry.CellAt({0, -kMaxCellIndex - 0.5}).has_value());
  EXPECT_FALSE(geometry.CellAt({1e300, 0}).has_value());
  EXPECT_FALSE(geometry.CellAt({std::numeric_limits<double>::quiet_NaN(), 0}).has_value());
  EXPECT_FALSE(geometry.CellAt({0, std::numeric_limits<double>::infinity()}).has_value());
}

TEST(GridGeometryTest, BoundsAreThoseOfTheCorners) {
  EXPECT_EQ((GridGeometry{PlanarTransform(1, 2, 0), 0.5}.BoundsOf({-2, 4, 0, 2})),
            (Box{{1, 1}, {2, 4}}));
  EXPECT_TRUE(kOffice.BoundsOf({3, 3, 0, 5}).empty());
  const Box turned =
      GridGeometry{PlanarTransform(0, 0, std::numbers::pi / 4), 1.0}.BoundsOf({0, 1, 0, 1});
  EXPECT_NEAR(turned.min.x, -std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(turned.max.y, std::sqrt(2.0), 1e-12);
}

TEST(CellBoxTest, UnionAndIntersection) {
  const CellBox a{0, 4, 0, 4}, b{2, 6, -1, 1}, far{10, 11, 10, 11}, none{3, 3, 0, 9};
  EXPECT_EQ(a.Union(b), (CellBox{0, 6, -1, 4}));
  EXPECT_EQ(a.Union(none), a);
  EXPECT_EQ(none.Union(a), a);
  EXPECT_EQ(a.Intersection(b), (CellBox{2, 4, 0, 1}));
  EXPECT_TRUE(a.Intersection(far).empty());
  EXPECT_TRUE(a.Intersection(none).empty());
  EXPECT_EQ(none.num_cells(), 0);
  EXPECT_EQ(kAllCells.num_cells(), int64_t{1} << 46);
  EXPECT_TRUE(a.Contains(none));
  EXPECT_FALSE(a.Contains(b));
}

}  // namespace
}  // namespace hypermap
