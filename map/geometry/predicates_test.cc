#include "map/geometry/predicates.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gtest/gtest.h"
#include "map/geometry/geos_context.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::RandomPolygon;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

// The exact orientation of points with integer coordinates below 2^52 in magnitude.
int IntegerOrientation(const Point& a, const Point& b, const Point& c) {
  __extension__ using Wide = __int128;
  const auto difference = [](double u, double v) {
    return static_cast<Wide>(u) - static_cast<Wide>(v);
  };
  const Wide determinant =
      difference(a.x, c.x) * difference(b.y, c.y) - difference(a.y, c.y) * difference(b.x, c.x);
  return (determinant > 0) - (determinant < 0);
}

Point Scaled(const Point& p, double factor) { return {p.x * factor, p.y * factor}; }

TEST(OrientationTest, IsExactForNearlyCollinearPoints) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const double limit = 0x1p51;
  int zeros = 0;
  for (int i = 0; i < 100000; ++i) {
    const double size = std::exp2(UniformInt(rng, 1, 51));
    const auto coordinate = [&] { return std::trunc(Uniform(rng, -size, size)); };
    const Point a{coordinate(), coordinate()}, b{coordinate(), coordinate()};
    const double t = Uniform(rng, -1, 2);
    const Point c{std::round(a.x + t * (b.x - a.x)) + UniformInt(rng, -1, 1),
                  std::round(a.y + t * (b.y - a.y)) + UniformInt(rng, -1, 1)};
    if (std::abs(c.x) > limit || std::abs(c.y) > limit) continue;
    const int expected = IntegerOrientation(a, b, c);
    zeros += expected == 0;
    // Powers of two do not change signs, even where products of the coordinates over- or underflow.
    for (const double factor : {1.0, 0x1p-30, 0x1p-800, 0x1p900}) {
      const Point fa = Scaled(a, factor), fb = Scaled(b, factor), fc = Scaled(c, factor);
      ASSERT_EQ(Orientation(fa, fb, fc), expected) << factor;
      ASSERT_EQ(Orientation(fb, fc, fa), expected) << factor;
      ASSERT_EQ(Orientation(fb, fa, fc), -expected) << factor;
    }
  }
  EXPECT_GT(zeros, 100);
}

// The sign of u * v - s * t, from the products of mantissas. Exact.
int SignOfDifference(double u, double v, double s, double t) {
  __extension__ using Wide = __int128;
  const auto product = [](double x, double y, int* exponent) {
    int of_x = 0, of_y = 0;
    const double mantissa_x = std::frexp(x, &of_x), mantissa_y = std::frexp(y, &of_y);
    *exponent = of_x + of_y;
    return static_cast<Wide>(std::ldexp(mantissa_x, 53)) *
           static_cast<Wide>(std::ldexp(mantissa_y, 53));
  };
  int of_left = 0, of_right = 0;
  const Wide left = product(u, v, &of_left), right = product(s, t, &of_right);
  const auto sign = [](Wide x) { return (x > 0) - (x < 0); };
  if (left == 0 || right == 0 || sign(left) != sign(right)) return sign(sign(left) - sign(right));
  // Products of mantissas have 105 or 106 bits.
  if (std::abs(of_left - of_right) > 2) return of_left > of_right ? sign(left) : -sign(right);
  const int least = std::min(of_left, of_right);
  return sign((left << (of_left - least)) - (right << (of_right - least)));
}

TEST(OrientationTest, IsExactForCoordinatesOfAllSizesTogether) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const auto coordinate = [&] {
    const double size = std::exp2(UniformInt(rng, 0, 1) == 0 ? UniformInt(rng, -1074, 29) : 0);
    return UniformInt(rng, 0, 4) == 0 ? 0.0 : size * Uniform(rng, -1, 1);
  };
  const Point origin{0.0, 0.0};
  for (int i = 0; i < 100000; ++i) {
    const Point a{coordinate(), coordinate()}, b{coordinate(), coordinate()};
    const int expected = SignOfDifference(a.x, b.y, a.y, b.x);
    ASSERT_EQ(Orientation(origin, a, b), expected) << a.x << " " << a.y << " " << b.x << " " << b.y;
    ASSERT_EQ(Orientation(a, b, origin), expected);
    const Point c{coordinate(), coordinate()};
    const int turn = Orientation(a, b, c);
    ASSERT_EQ(Orientation(b, c, a), turn);
    ASSERT_EQ(Orientation(b, a, c), -turn);
  }
}

TEST(OrientationTest, SeesOneUlp) {
  const Point a{12.0, 12.0}, b{24.0, 24.0};
  const double up = std::nextafter(0.5, 1.0);
  EXPECT_EQ(Orientation(a, b, {0.5, 0.5}), 0);
  EXPECT_EQ(Orientation(a, b, {0.5, up}), 1);
  EXPECT_EQ(Orientation(a, b, {up, 0.5}), -1);
}

// Returns a random point around the polygon, often on its boundary or next to it.
Point InterestingPoint(Rng& rng, const Polygon& polygon, double snap_m) {
  const Ring& ring = polygon.rings()[UniformInt(rng, 0, polygon.rings().size() - 1)];
  const int i = UniformInt(rng, 0, ring.size() - 1);
  const Point& a = ring[i];
  const Point& b = ring[(i + 1) % ring.size()];
  switch (UniformInt(rng, 0, 4)) {
    case 0:
      return a;
    case 1:
      return {a.x, b.y};
    case 2: {
      const double t = Uniform(rng, 0, 1);
      return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
    }
    case 3:
      return {(a.x + b.x) / 2, (a.y + b.y) / 2};
    default: {
      const Box& box = polygon.bounds();
      const Point p{Uniform(rng, box.min.x - 1, box.max.x + 1),
                    Uniform(rng, box.min.y - 1, box.max.y + 1)};
      return {std::round(p.x / snap_m) * snap_m, std::round(p.y / snap_m) * snap_m};
    }
  }
}

TEST(PredicatesTest, CoversAndDistanceAgreeWithGeos) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const GeosContext geos;
  int covered = 0, points = 0;
  for (int i = 0; i < 400; ++i) {
    const double snap_m = i % 2 ? 0.025 : 0.25;
    const Polygon polygon =
        RandomPolygon(rng, {Uniform(rng, -20, 20), Uniform(rng, -20, 20)}, 2.0, i % 4 ? snap_m : 0);
    const GeosGeometry expected = geos.MakePolygon(polygon.rings());
    for (int j = 0; j < 100; ++j, ++points) {
      const Point p = InterestingPoint(rng, polygon, snap_m);
      const GeosGeometry point = geos.Own(GEOSGeom_createPointFromXY_r(geos.handle(), p.x, p.y));
      const bool covers = GEOSCovers_r(geos.handle(), expected.get(), point.get()) == 1;
      covered += covers;
      ASSERT_EQ(Covers(polygon, p), covers) << p.x << " " << p.y;
      double distance = -1;
      ASSERT_EQ(GEOSDistance_r(geos.handle(), expected.get(), point.get(), &distance), 1);
      ASSERT_NEAR(Distance(polygon, p), distance, 1e-12);
    }
  }
  EXPECT_GT(covered, points / 10);
  EXPECT_LT(covered, points * 9 / 10);
}

TEST(PredicatesTest, BoundariesOfHolesAreCovered) {
  const Polygon polygon =
      *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {3, 1}, {3, 3}, {1, 3}}});
  EXPECT_TRUE(Covers(polygon, {1, 2}));
  EXPECT_TRUE(Covers(polygon, {3, 3}));
  EXPECT_TRUE(Covers(polygon, {0.5, 1}));
  EXPECT_FALSE(Covers(polygon, {2, 2}));
  EXPECT_FALSE(Covers(polygon, {std::nextafter(1.0, 2.0), 2}));
  EXPECT_EQ(Distance(polygon, {2, 1.5}), 0.5);
}

TEST(PredicatesTest, NothingIsCoveredThatIsNotFinite) {
  const Polygon polygon = Polygon::FromBox({{0, 0}, {1, 1}});
  EXPECT_FALSE(Covers(polygon, {std::numeric_limits<double>::quiet_NaN(), 0.5}));
  EXPECT_FALSE(Covers(polygon, {std::numeric_limits<double>::infinity(), 0.5}));
  EXPECT_FALSE(Covers(Polygon(), {0, 0}));
  EXPECT_EQ(Distance(Polygon(), {0, 0}), std::numeric_limits<double>::infinity());
}

TEST(PreparedPolygonTest, PolygonsThatTouchIntersect) {
  const Polygon ring =
      *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {3, 1}, {3, 3}, {1, 3}}});
  const PreparedPolygon prepared(ring);
  const auto box = [](double x0, double y0, double x1, double y1) {
    return Polygon::FromBox({{x0, y0}, {x1, y1}});
  };
  EXPECT_TRUE(prepared.Intersects(box(4, 4, 5, 5)));        // Corner to corner.
  EXPECT_TRUE(prepared.Intersects(box(4, 1, 5, 2)));        // Edge along edge.
  EXPECT_TRUE(prepared.Intersects(box(1, 1, 3, 3)));        // Fills the hole.
  EXPECT_TRUE(prepared.Intersects(box(-1, -1, 5, 5)));      // Around it.
  EXPECT_TRUE(prepared.Intersects(box(0.2, 0.2, 0.3, 3)));  // Within it.
  EXPECT_FALSE(prepared.Intersects(box(1.1, 1.1, 2.9, 2.9)));
  EXPECT_FALSE(prepared.Intersects(box(std::nextafter(4.0, 5.0), 0, 5, 4)));
  EXPECT_FALSE(prepared.Intersects(Polygon()));

  EXPECT_TRUE(prepared.Covers(box(0, 0, 1, 4)));
  EXPECT_TRUE(prepared.Covers(ring));
  EXPECT_FALSE(prepared.Covers(box(0, 0, 4, 4)));
  EXPECT_FALSE(prepared.Covers(box(0, 0, std::nextafter(1.0, 2.0), 4)));
}

// Small polygons in few tests are scanned; large polygons and many tests use GEOS.
TEST(PreparedPolygonTest, AgreesWithGeosWhicheverWayItTakes) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const GeosContext geos;
  int intersections = 0, tests = 0;
  for (int i = 0; i < 300; ++i) {
    // On a lattice, polygons often touch at a vertex or along an edge, or fill a hole.
    const double snap_m = i % 3 ? 0.25 : 0;
    const Polygon area = RandomPolygon(rng, {0, 0}, Uniform(rng, 0.5, 8), snap_m);
    const PreparedPolygon prepared(area);
    const GeosGeometry expected_area = geos.MakePolygon(area.rings());
    for (int j = 0; j < 60; ++j, ++tests) {
      Polygon other = RandomPolygon(rng, {Uniform(rng, -6, 6), Uniform(rng, -6, 6)},
                                    Uniform(rng, 0.5, 4), snap_m);
      if (j % 20 == 19) {
        Ring ring;
        for (int k = 0; k < 2000; ++k) {
          const double angle = 2 * M_PI * k / 2000;
          ring.push_back({5 * std::cos(angle), 5 * std::sin(angle)});
        }
        other = *Polygon::Make(ring);
      }
      const GeosGeometry expected_other = geos.MakePolygon(other.rings());
      const bool expected =
          GEOSIntersects_r(geos.handle(), expected_area.get(), expected_other.get()) == 1;
      intersections += expected;
      ASSERT_EQ(prepared.Intersects(other), expected);
      ASSERT_EQ(PreparedPolygon(other).Intersects(area), expected);
    }
  }
  EXPECT_GT(intersections, tests / 10);
  EXPECT_LT(intersections, tests * 9 / 10);
}

// The first points are compared with all edges, the others with those in GEOS's index.
TEST(PreparedPolygonTest, A4ManyPointsInAPolygonOfManyVertices) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  Ring star, hole;
  for (int i = 0; i < 6000; ++i) {
    const double angle = 2 * M_PI * i / 6000, radius = i % 2 == 0 ? 5.0 : 4.0;
    star.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    hole.push_back({0.5 * star.back().x, 0.5 * star.back().y});
  }
  const Polygon polygon = *Polygon::Make(star, {hole});
  const PreparedPolygon intersecting(polygon), covering(polygon);
  int covered = 0;
  for (int i = 0; i < 2000; ++i) {
    Point p{Uniform(rng, -5, 5), Uniform(rng, -5, 5)};
    if (i % 4 == 0) p = polygon.rings()[i % 8 / 4][UniformInt(rng, 0, 5999)];
    const bool expected = Covers(polygon, p);
    covered += expected;
    const Shape point = *Shape::MakePoint(p);
    ASSERT_EQ(intersecting.Intersects(point), expected) << i;
    ASSERT_EQ(covering.Covers(point), expected) << i;
  }
  EXPECT_GT(covered, 600);
  EXPECT_LT(covered, 1900);
}

TEST(PreparedPolygonTest, OutlivesThePolygonAndMoves) {
  std::vector<PreparedPolygon> prepared;
  for (int i = 0; i < 3; ++i) {
    prepared.emplace_back(Polygon::FromBox({{10.0 * i, 0}, {10.0 * i + 1, 1}}));
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(prepared[i].Intersects(Polygon::FromBox({{10.0 * i, 0}, {10.0 * i + 5, 1}})));
    EXPECT_FALSE(prepared[i].Intersects(Polygon::FromBox({{10.0 * i + 2, 0}, {10.0 * i + 5, 1}})));
  }
}

}  // namespace
}  // namespace hypermap
