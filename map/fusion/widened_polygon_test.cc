#include "map/fusion/widened_polygon.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "gtest/gtest.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "tests/support/random_map.h"

namespace hypermap::fusion {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

// The hull of all sums of a vertex of the polygon and a vertex of the octagon.
Polygon MinkowskiSumBruteForce(const Polygon& convex, double margin_m) {
  std::vector<Point> sums;
  for (const Point& p : convex.outer()) {
    for (int k = 0; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 4.0;
      sums.push_back({p.x + margin_m * std::cos(angle), p.y + margin_m * std::sin(angle)});
    }
  }
  return ConvexHull(sums);
}

TEST(WidenedTest, IsTheMinkowskiSumWithAnOctagon) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int round = 0; round < 300; ++round) {
    std::vector<Point> points(static_cast<size_t>(UniformInt(rng, 3, 12)));
    for (Point& p : points) p = {Uniform(rng, -1.0, 1.0), Uniform(rng, -1.0, 1.0)};
    const Polygon convex = ConvexHull(points);
    const double margin_m = Uniform(rng, 0.01, 0.5);
    const Polygon wide = Widened(convex, margin_m);
    const Polygon expected = MinkowskiSumBruteForce(convex, margin_m);
    EXPECT_NEAR(Area(wide), Area(expected), 1e-9);
    EXPECT_NEAR(IntersectionArea(wide, expected), Area(expected), 1e-9);
    EXPECT_LE(wide.num_vertices(), convex.num_vertices() + 8);
  }
}

TEST(WidenedTest, BoxGrowsByTheMarginOnAllSides) {
  const Polygon wide = Widened(Polygon::FromBox(Box{{1.0, 2.0}, {3.0, 5.0}}), 0.25);
  EXPECT_EQ(wide.bounds(), (Box{{0.75, 1.75}, {3.25, 5.25}}));
  EXPECT_EQ(wide.num_vertices(), 12);
}

TEST(WidenedTest, NothingToWiden) {
  const Polygon box = Polygon::FromBox(Box{{0.0, 0.0}, {1.0, 1.0}});
  EXPECT_EQ(Widened(box, 0.0), box);
  EXPECT_EQ(Widened(box, -1.0), box);
  EXPECT_TRUE(Widened(Polygon(), 0.1).empty());
}

}  // namespace
}  // namespace hypermap::fusion
