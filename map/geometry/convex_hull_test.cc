#include "map/geometry/convex_hull.h"

#include <limits>

#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

TEST(ConvexHullTest, KeepsOnlyTheCorners) {
  const Polygon hull = ConvexHull({{1, 1}, {2, 0}, {0, 0}, {1, 0}, {2, 2}, {0, 2}, {0, 1}, {2, 2}});
  EXPECT_EQ(hull.outer(), (Ring{{0, 0}, {2, 0}, {2, 2}, {0, 2}}));
}

TEST(ConvexHullTest, IsEmptyWithoutAnArea) {
  EXPECT_TRUE(ConvexHull({}).empty());
  EXPECT_TRUE(ConvexHull({{1, 2}, {3, 4}}).empty());
  EXPECT_TRUE(ConvexHull({{1, 2}, {1, 2}, {1, 2}, {1, 2}}).empty());
  EXPECT_TRUE(ConvexHull({{0, 0}, {3, 1}, {6, 2}, {-9, -3}}).empty());
}

TEST(ConvexHullTest, LeavesOutPointsThatAreNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Polygon hull = ConvexHull({{0, 0}, {nan, 1}, {1, 0}, {infinity, 5}, {0, 1}});
  EXPECT_EQ(hull.outer(), (Ring{{0, 0}, {1, 0}, {0, 1}}));
}

TEST(ConvexHullTest, CoversItsPointsAndIsAValidConvexPolygon) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 500; ++i) {
    std::vector<Point> points(UniformInt(rng, 3, 60));
    const bool snapped = UniformInt(rng, 0, 1) == 1;  // Many points on one line.
    for (Point& p : points) {
      p = snapped ? Point{double(UniformInt(rng, 0, 4)), double(UniformInt(rng, 0, 4))}
                  : Point{Uniform(rng, -1, 1), Uniform(rng, -1, 1)};
    }
    const Polygon hull = ConvexHull(points);
    if (hull.empty()) continue;
    ASSERT_TRUE(IsConvex(hull));
    const auto made = Polygon::Make(hull.outer());
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(*made, hull);
    for (const Point& p : points) EXPECT_TRUE(Covers(hull, p));
    for (const Point& corner : hull.outer()) {
      EXPECT_NE(std::find(points.begin(), points.end(), corner), points.end());
    }
  }
}

TEST(IsConvexTest, TellsNotchesAndHoles) {
  EXPECT_TRUE(IsConvex(*Polygon::Make({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}})));
  EXPECT_FALSE(IsConvex(*Polygon::Make({{0, 0}, {2, 0}, {2, 2}, {1, 0.5}, {0, 2}})));
  EXPECT_FALSE(
      IsConvex(*Polygon::Make({{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{{1, 1}, {2, 1}, {2, 2}}})));
  EXPECT_FALSE(IsConvex(Polygon()));
}

}  // namespace
}  // namespace hypermap
