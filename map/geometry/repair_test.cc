#include "map/geometry/repair.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/predicates.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

double TotalArea(const std::vector<Polygon>& polygons) {
  double area = 0;
  for (const Polygon& polygon : polygons) area += Area(polygon);
  return area;
}

TEST(FillNonZeroTest, AValidRingKeepsItsVertices) {
  const Ring ring = {{0.1, 0.2}, {2.3, 0.1}, {2.2, 2.7}, {0.3, 1.9}};
  const auto polygons = FillNonZero(ring);
  ASSERT_TRUE(polygons.ok()) << polygons.status();
  EXPECT_THAT(*polygons, ElementsAre(*Polygon::Make(ring)));
}

TEST(FillNonZeroTest, AHullGoneRoundSeveralTimesIsFilled) {
  const Ring square = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
  Ring thrice;
  for (int i = 0; i < 3; ++i) thrice.insert(thrice.end(), square.begin(), square.end());
  const auto polygons = FillNonZero(thrice);
  ASSERT_TRUE(polygons.ok()) << polygons.status();
  ASSERT_EQ(polygons->size(), 1u);
  EXPECT_EQ(Area(polygons->front()), 4.0);
  EXPECT_EQ(polygons->front().num_vertices(), 4);
}

TEST(FillNonZeroTest, TheMiddleOfAPentagramIsFilled) {
  Ring star;
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * std::numbers::pi * 2 * i / 5;
    star.push_back({std::cos(angle), std::sin(angle)});
  }
  const auto polygons = FillNonZero(star);
  ASSERT_TRUE(polygons.ok()) << polygons.status();
  ASSERT_EQ(polygons->size(), 1u);
  EXPECT_TRUE(Covers(polygons->front(), {0, 0}));
  EXPECT_EQ(polygons->front().num_vertices(), 10);
}

TEST(FillNonZeroTest, AFigureEightBecomesItsLoopsLargestFirst) {
  const auto polygons = FillNonZero({{0, 0}, {3, 3}, {3, 0}, {0, 3}, {-1, 3}, {-1, 0}});
  ASSERT_TRUE(polygons.ok()) << polygons.status();
  ASSERT_EQ(polygons->size(), 2u);
  EXPECT_GT(Area((*polygons)[0]), Area((*polygons)[1]));
  EXPECT_TRUE(Covers((*polygons)[0], {-0.5, 1}));
  EXPECT_TRUE(Covers((*polygons)[1], {2.5, 1.5}));
}

TEST(FillNonZeroTest, SpikesAreDropped) {
  const auto polygons = FillNonZero({{0, 0}, {4, 0}, {4, 4}, {9, 9}, {4, 4}, {0, 4}});
  ASSERT_TRUE(polygons.ok()) << polygons.status();
  ASSERT_EQ(polygons->size(), 1u);
  EXPECT_EQ(polygons->front().bounds(), (Box{{0, 0}, {4, 4}}));
  EXPECT_EQ(TotalArea(*polygons), 16.0);
}

TEST(FillNonZeroTest, ARingInsideTurnedTheOtherWayIsAHole) {
  // The ring goes round the outside, inwards along a slit, and round the hole in the other
  // direction.
  const auto polygons =
      FillNonZero({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}});
  ASSERT_TRUE(polygons.ok()) << polygons.status();
  ASSERT_EQ(polygons->size(), 1u);
  EXPECT_EQ(TotalArea(*polygons), 12.0);
  EXPECT_FALSE(Covers(polygons->front(), {2, 2}));
}

TEST(FillNonZeroTest, RefusesWhatHasNoArea) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<Ring, std::string>> rings = {
      {{}, "outer has fewer than 3 distinct vertices"},
      {{{0, 0}, {1, 1}, {0, 0}}, "outer has fewer than 3 distinct vertices"},
      {{{0, 0}, {1, nan}, {1, 1}}, "outer[1] is not finite"},
      {{{0, 0}, {1, 1}, {2, 2}, {3, 3}}, "outer ring encloses no area"},
      {{{0, 0}, {1, 0}, {1, 1}, {1, 0}}, "outer ring encloses no area"},
  };
  for (const auto& [ring, message] : rings) {
    const auto polygons = FillNonZero(ring);
    ASSERT_FALSE(polygons.ok());
    EXPECT_EQ(polygons.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(std::string(polygons.status().message()), message);
  }
}

// Computes the winding number from the angle that the ring sweeps around the point.
int SweptWinding(const Ring& ring, const Point& p) {
  double angle = 0;
  for (size_t i = 0; i < ring.size(); ++i) {
    const Point& a = ring[i];
    const Point& b = ring[(i + 1) % ring.size()];
    angle += std::remainder(std::atan2(b.y - p.y, b.x - p.x) - std::atan2(a.y - p.y, a.x - p.x),
                            2 * std::numbers::pi);
  }
  return static_cast<int>(std::lround(angle / (2 * std::numbers::pi)));
}

double DistanceToEdges(const Ring& ring, const Point& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < ring.size(); ++i) {
    const Point& a = ring[i];
    const Point& b = ring[(i + 1) % ring.size()];
    nearest = std::min(nearest, Distance(Polygon::MakeUnchecked({{a, b}}), p));
  }
  return nearest;
}

TEST(FillNonZeroTest, CoversWhatRandomRingsWindRound) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  int inside = 0;
  for (int i = 0; i < 1000; ++i) {
    // On a coarse grid, edges overlap and rings touch themselves.
    const bool snapped = i % 2;
    Ring ring(UniformInt(rng, 4, 14));
    for (Point& p : ring) {
      p = {Uniform(rng, 0, 6), Uniform(rng, 0, 6)};
      if (snapped) p = {std::round(p.x), std::round(p.y)};
    }
    const auto polygons = FillNonZero(ring);
    for (int j = 0; j < 50; ++j) {
      const Point p{Uniform(rng, -1, 7), Uniform(rng, -1, 7)};
      if (DistanceToEdges(ring, p) < 1e-6) continue;
      int covering = 0;
      if (polygons.ok()) {
        for (const Polygon& polygon : *polygons) covering += Covers(polygon, p);
      }
      const bool wound = SweptWinding(ring, p) != 0;
      ASSERT_EQ(covering, wound ? 1 : 0) << p.x << " " << p.y << " " << polygons.status();
      inside += wound;
    }
  }
  EXPECT_GT(inside, 5000);
}

}  // namespace
}  // namespace hypermap
