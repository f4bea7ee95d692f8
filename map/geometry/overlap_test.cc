#include "map/geometry/overlap.h"

#include "gtest/gtest.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/predicates.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::RandomPolygon;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

Polygon Rectangle(double x0, double y0, double x1, double y1) {
  return Polygon::FromBox({{x0, y0}, {x1, y1}});
}

// Estimates the area that both cover, by sampling the centre of each cell of a fine grid.
double SampledIntersection(const Polygon& a, const Polygon& b, double step_m) {
  int covered = 0;
  const Box& box = a.bounds();
  for (double y = box.min.y + step_m / 2; y < box.max.y; y += step_m) {
    for (double x = box.min.x + step_m / 2; x < box.max.x; x += step_m) {
      covered += Covers(a, {x, y}) && Covers(b, {x, y});
    }
  }
  return covered * step_m * step_m;
}

TEST(OverlapTest, OfRectangles) {
  const Polygon a = Rectangle(0, 0, 4, 2);
  EXPECT_DOUBLE_EQ(IntersectionArea(a, Rectangle(3, 1, 6, 5)), 1.0);
  EXPECT_DOUBLE_EQ(Iou(a, Rectangle(3, 1, 6, 5)), 1.0 / 19.0);
  EXPECT_DOUBLE_EQ(Iou(a, Rectangle(1, 0, 3, 2)), 0.5);
  EXPECT_DOUBLE_EQ(Iou(a, a), 1.0);
}

TEST(OverlapTest, IsNothingWhereTheyOnlyTouch) {
  const Polygon a = Rectangle(0, 0, 1, 1);
  EXPECT_EQ(IntersectionArea(a, Rectangle(1, 0, 2, 1)), 0.0);
  EXPECT_EQ(IntersectionArea(a, Rectangle(1, 1, 2, 2)), 0.0);
  EXPECT_EQ(Iou(a, Rectangle(5, 5, 6, 6)), 0.0);
  EXPECT_EQ(Iou(a, Polygon()), 0.0);
  EXPECT_EQ(Iou(Polygon(), Polygon()), 0.0);
}

TEST(OverlapTest, TakesHolesAndNotchesOut) {
  const Polygon frame =
      *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {3, 1}, {3, 3}, {1, 3}}});
  EXPECT_DOUBLE_EQ(IntersectionArea(frame, Rectangle(0, 0, 4, 2)), 6.0);
  EXPECT_DOUBLE_EQ(IntersectionArea(frame, Rectangle(1, 1, 3, 3)), 0.0);
  const Polygon notched = *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}});
  EXPECT_DOUBLE_EQ(IntersectionArea(notched, Rectangle(0, 0, 2, 4)), 5.0);
}

TEST(OverlapTest, KeepsItsDigitsFarFromTheOrigin) {
  const double x = 1e6, y = -2e6;
  EXPECT_NEAR(IntersectionArea(Rectangle(x, y, x + 0.08, y + 0.08),
                               Rectangle(x + 0.04, y, x + 0.12, y + 0.08)),
              0.0032, 1e-9);
}

// Convex pairs are clipped and all others go to GEOS; a vertex moved inwards makes a pair use GEOS.
TEST(OverlapTest, BothWaysAgree) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const auto random_hull = [&] {
    std::vector<Point> points(UniformInt(rng, 3, 20));
    const bool snapped = UniformInt(rng, 0, 1) == 1;
    for (Point& p : points) {
      p = snapped ? Point{double(UniformInt(rng, 0, 3)), double(UniformInt(rng, 0, 3))}
                  : Point{Uniform(rng, 0, 3), Uniform(rng, 0, 3)};
    }
    return ConvexHull(points);
  };
  // A square around a polygon, with the polygon as its hole.
  const auto with_hole = [](const Polygon& p) {
    return *Polygon::Make({{-9, -9}, {50, -9}, {50, 50}, {-9, 50}}, {p.outer()});
  };
  int overlapping = 0;
  for (int i = 0; i < 1000; ++i) {
    const Polygon a = random_hull(), b = random_hull();
    if (a.empty() || b.empty()) continue;
    const double shared = IntersectionArea(a, b);
    EXPECT_NEAR(shared, Area(b) - IntersectionArea(with_hole(a), b), 1e-9);
    EXPECT_NEAR(shared, IntersectionArea(b, a), 1e-12);
    overlapping += shared > 0.0;
  }
  EXPECT_GT(overlapping, 100);
}

TEST(OverlapTest, AgreesWithSampling) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 50; ++i) {
    const Polygon a = RandomPolygon(rng, {0, 0}, 1.0);
    const Polygon b = RandomPolygon(rng, {Uniform(rng, -1, 1), Uniform(rng, -1, 1)}, 1.0);
    EXPECT_NEAR(IntersectionArea(a, b), SampledIntersection(a, b, 0.01), 0.05);
  }
}

}  // namespace
}  // namespace hypermap
