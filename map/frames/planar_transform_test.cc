#include "map/frames/planar_transform.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "gtest/gtest.h"
#include "tests/support/not_finite.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using std::numbers::pi;
using testing::kNan;
using testing::RandomPolygon;
using testing::RandomShape;
using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;

void ExpectNear(const Point& a, const Point& b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
}

void ExpectNear(const PlanarTransform& a, const PlanarTransform& b, double tolerance) {
  EXPECT_NEAR(a.x(), b.x(), tolerance);
  EXPECT_NEAR(a.y(), b.y(), tolerance);
  EXPECT_NEAR(std::remainder(a.yaw() - b.yaw(), 2 * pi), 0.0, tolerance);
}

TEST(PlanarTransformTest, TurnsThenMoves) {
  const PlanarTransform t(10, 20, pi / 2);
  ExpectNear(t * Point{1, 0}, {10, 21}, 1e-14);
  ExpectNear(t * Point{0, 1}, {9, 20}, 1e-14);
  ExpectNear(t.ApplyInverse({10, 21}), {1, 0}, 1e-14);
}

TEST(PlanarTransformTest, YawIsBroughtIntoTheHalfOpenTurn) {
  EXPECT_EQ(PlanarTransform(0, 0, pi).yaw(), pi);
  EXPECT_EQ(PlanarTransform(0, 0, -pi).yaw(), pi);
  EXPECT_EQ(PlanarTransform(0, 0, 2 * pi).yaw(), 0.0);
  EXPECT_NEAR(PlanarTransform(0, 0, 3 * pi / 2).yaw(), -pi / 2, 1e-15);
  EXPECT_NEAR(PlanarTransform(0, 0, 7 * pi).yaw(), pi, 1e-14);
  EXPECT_EQ(PlanarTransform(0, 0, 1e-300).yaw(), 1e-300);
  EXPECT_EQ(PlanarTransform(0, 0, -3.0).yaw(), -3.0);
}

TEST(PlanarTransformTest, WithoutATurnOnlyTheAdditionRounds) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 1000; ++i) {
    const PlanarTransform t(Uniform(rng, -100, 100), Uniform(rng, -1e6, 1e6), 0);
    const Point p{Uniform(rng, -100, 100), Uniform(rng, -1e-3, 1e-3)};
    EXPECT_EQ(t * p, (Point{t.x() + p.x, t.y() + p.y}));
    EXPECT_EQ(t.ApplyInverse(p), (Point{p.x - t.x(), p.y - t.y()}));
    EXPECT_EQ(t.Inverse(), PlanarTransform(-t.x(), -t.y(), 0));
    EXPECT_EQ(t.Inverse().Inverse(), t);
    EXPECT_TRUE((t * t.Inverse()).IsIdentity());
  }
  EXPECT_FALSE(std::signbit(PlanarTransform().Inverse().x()));
}

TEST(PlanarTransformTest, IsAGroup) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 1000; ++i) {
    const PlanarTransform a = RandomTransform(rng, 100), b = RandomTransform(rng, 100),
                          c = RandomTransform(rng, 100);
    const Point p{Uniform(rng, -100, 100), Uniform(rng, -100, 100)};
    ExpectNear((a * b) * c, a * (b * c), 1e-11);
    ExpectNear((a * b) * p, a * (b * p), 1e-11);
    ExpectNear(a * a.Inverse(), PlanarTransform(), 1e-11);
    ExpectNear(a.Inverse() * a, PlanarTransform(), 1e-11);
    ExpectNear((a * b).Inverse(), b.Inverse() * a.Inverse(), 1e-11);
    ExpectNear(a.ApplyInverse(p), a.Inverse() * p, 1e-11);
    EXPECT_EQ(PlanarTransform() * a, a);
    EXPECT_EQ(a * PlanarTransform(), a);
  }
}

TEST(PlanarTransformTest, MovesPolygonsVertexByVertex) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const Polygon polygon = RandomPolygon(rng, {3, 4}, 2);
  const PlanarTransform t = RandomTransform(rng, 10);
  const Polygon moved = t * polygon;
  ASSERT_EQ(moved.rings().size(), polygon.rings().size());
  for (size_t i = 0; i < polygon.rings().size(); ++i) {
    ASSERT_EQ(moved.rings()[i].size(), polygon.rings()[i].size());
    for (size_t j = 0; j < polygon.rings()[i].size(); ++j) {
      EXPECT_EQ(moved.rings()[i][j], t * polygon.rings()[i][j]);
    }
  }
  EXPECT_NEAR(Area(moved), Area(polygon), 1e-10);
  EXPECT_EQ(PlanarTransform() * polygon, polygon);
}

TEST(MovedTest, GivesTheMovedShapeOfEveryKind) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 300; ++i) {
    const Shape shape = RandomShape(rng, {Uniform(rng, -9, 9), 3}, 2);
    const PlanarTransform t = RandomTransform(rng, 1000);
    const auto moved = Moved(t, shape);
    ASSERT_TRUE(moved.ok()) << moved.status();
    EXPECT_EQ(*moved, t * shape);
    EXPECT_EQ(*Moved(PlanarTransform(), shape), shape);
  }
}

TEST(MovedTest, RefusesVerticesBeyondTheBound) {
  const PlanarTransform east(1e9, 0, 0);
  const Ring outer{{-10, -10}, {-1, -10}, {-1, -1}, {-10, -1}};
  const Ring hole{{-5, -5}, {-4, -5}, {-4, -4}};
  const std::pair<Shape, const char*> cases[] = {
      {*Shape::MakePoint({1, 0}), "point is more than 1e+09 m from the origin"},
      {*LineString::Make({{-1, 0}, {1, 0}}), "vertices[1] is more than 1e+09 m from the origin"},
      {Polygon::FromBox({{-1, 0}, {1, 1}}), "outer[1] is more than 1e+09 m from the origin"},
  };
  for (const auto& [shape, message] : cases) {
    const auto moved = Moved(east, shape);
    EXPECT_TRUE(absl::IsInvalidArgument(moved.status())) << moved.status();
    EXPECT_EQ(moved.status().message(), message);
    EXPECT_TRUE(Moved(PlanarTransform(1e9 - 1, 0, 0), shape).ok());
  }
  EXPECT_TRUE(Moved(east, *Polygon::Make(outer, {hole})).ok());
  // Numbers that are not finite are refused, too.
  const PlanarTransform huge =
      PlanarTransform(1e308, 1e308, 0.5) * PlanarTransform(1e308, 1e308, 0);
  for (const auto& [shape, message] : cases) {
    EXPECT_TRUE(absl::IsInvalidArgument(Moved(huge, shape).status()));
  }
}

// A moved shape is read from a store as it was written, or not accepted.
TEST(MovedTest, GivesNoRingsThatRoundingHasTurned) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  int turned = 0, refused = 0;
  for (int i = 0; i < 30'000; ++i) {
    // Coordinates from 6e8 to 9e8 m are multiples of this.
    constexpr double kBit = 0x1p-23;
    Ring ring(4);
    for (Point& p : ring) p = {Uniform(rng, 0, 3 * kBit), Uniform(rng, 0, 3 * kBit)};
    const auto tiny = Polygon::Make(ring);
    if (!tiny.ok()) continue;
    const PlanarTransform t(Uniform(rng, 6e8, 9e8), 7e8, Uniform(rng, -3, 3));
    turned += RunsBackwards((t * *tiny).rings());
    const auto moved = Moved(t, *tiny);
    if (!moved.ok()) {
      EXPECT_TRUE(absl::IsInvalidArgument(moved.status())) << moved.status();
      ++refused;
      continue;
    }
    ASSERT_FALSE(RunsBackwards(moved->polygon().rings()));
  }
  EXPECT_GT(turned, 10);
  EXPECT_GT(refused, 5);
}

TEST(PlanarTransformTest, TranslationIsWithinBoundsUpToTheBoundOfCoordinates) {
  EXPECT_TRUE(IsWithinBounds({}));
  EXPECT_TRUE(IsWithinBounds({kMaxCoordinate_m, -kMaxCoordinate_m, 3}));
  for (const double far : {1.0000001e9, -1e10, 1e308, kNan, HUGE_VAL}) {
    EXPECT_FALSE(IsWithinBounds({far, 0, 0}));
    EXPECT_FALSE(IsWithinBounds({0, far, 0}));
    const absl::Status status = CheckTranslation("origin", {0, far, 0});
    EXPECT_TRUE(absl::IsInvalidArgument(status));
    EXPECT_EQ(status.message(), "origin: x or y is more than 1e+09 m");
  }
}

TEST(PlanarTransformTest, BoundsHoldEveryMovedPointOfTheBox) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 2000; ++i) {
    const PlanarTransform t =
        i % 3 ? RandomTransform(rng, 1000) : PlanarTransform(Uniform(rng, -9, 9), 0.1, 0);
    const Box box{{Uniform(rng, -9, 0), Uniform(rng, -9, 0)}, {Uniform(rng, 0, 9), 9}};
    const Box bounds = BoundsOf(t, box);
    for (int j = 0; j < 20; ++j) {
      // Corners, edges and the inside.
      const double u = std::clamp(Uniform(rng, -1, 2), 0.0, 1.0);
      const double v = std::clamp(Uniform(rng, -1, 2), 0.0, 1.0);
      const Point p{u == 1 ? box.max.x : box.min.x + u * (box.max.x - box.min.x),
                    v == 1 ? box.max.y : box.min.y + v * (box.max.y - box.min.y)};
      ASSERT_TRUE(!box.Covers(p) || bounds.Covers(t * p));
    }
    EXPECT_LE(bounds.max.x - bounds.min.x, std::hypot(box.max.x - box.min.x, 18) + 1e-9);
  }
  EXPECT_TRUE(BoundsOf(PlanarTransform(1, 2, 3), Box()).empty());
  EXPECT_EQ(BoundsOf(PlanarTransform(1, 2, 0), Box{{0, 0}, {1, 1}}), (Box{{1, 2}, {2, 3}}));
}

}  // namespace
}  // namespace hypermap
