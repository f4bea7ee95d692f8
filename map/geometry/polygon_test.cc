#include "map/geometry/polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/not_finite.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using testing::RandomPolygon;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;

using hypermap::testing::kNan;
constexpr double kInf = std::numeric_limits<double>::infinity();

const Ring kSquare = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};

TEST(PolygonTest, KeepsOrderAndCoordinatesOfANormalRing) {
  const auto polygon = Polygon::Make(kSquare);
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_THAT(polygon->rings(), ElementsAre(kSquare));
  EXPECT_EQ(polygon->bounds(), (Box{{0, 0}, {4, 4}}));
  EXPECT_EQ(polygon->num_vertices(), 4);
}

TEST(PolygonTest, DropsTheClosingAndRepeatedVertices) {
  const auto polygon =
      Polygon::Make({{0, 0}, {0, 0}, {4, 0}, {4, 4}, {4, 4}, {4, 4}, {0, 4}, {0, 0}, {0, 0}});
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_EQ(polygon->outer(), kSquare);
}

TEST(PolygonTest, TurnsRingsAndKeepsTheirFirstVertex) {
  const auto polygon = Polygon::Make({{0, 0}, {0, 4}, {4, 4}, {4, 0}},
                                     {{{1, 1}, {2, 1}, {2, 2}}, {{3, 3}, {3, 2}, {2.5, 3}}});
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_THAT(polygon->rings(),
              ElementsAre(kSquare, Ring{{1, 1}, {2, 2}, {2, 1}}, Ring{{3, 3}, {3, 2}, {2.5, 3}}));
}

TEST(PolygonTest, FindsTheWindingOfAThinRingFarFromTheOrigin) {
  // So thin that its area is 0 in doubles.
  const Ring clockwise = {{1e8, 1e8}, {1e8 + 1, 1e8 + 1.5e-8}, {1e8 + 2, 1e8}};
  const auto polygon = Polygon::Make(clockwise);
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_EQ(polygon->outer(), (Ring{clockwise[0], clockwise[2], clockwise[1]}));
}

TEST(PolygonTest, AllowsRingsThatTouchInAPoint) {
  EXPECT_TRUE(Polygon::Make(kSquare, {{{0, 2}, {1, 1}, {1, 3}}}).ok());
  EXPECT_TRUE(Polygon::Make(kSquare, {{{1, 1}, {2, 1}, {2, 2}}, {{2, 2}, {3, 2}, {3, 3}}}).ok());
}

// Returns a ring through every `step`-th of points on a circle: convex for 1; for larger steps a
// star, which turns the same way everywhere and crosses itself.
Ring Circular(int vertices, int step, double phase) {
  Ring ring;
  for (int i = 0; i < vertices; ++i) {
    const double angle = phase + 2 * M_PI * i * step / vertices;
    ring.push_back({3 + std::cos(angle), -2 + std::sin(angle)});
  }
  return ring;
}

TEST(PolygonTest, ConvexRingsAreTakenAndStarsThatTurnOneWayAreNot) {
  for (int vertices = 5; vertices < 40; vertices += 2) {
    for (const double phase : {0.0, 0.1, 1.0, 2.5, 4.0}) {
      Ring convex = Circular(vertices, 1, phase);
      EXPECT_TRUE(Polygon::Make(convex).ok()) << vertices << " " << phase;
      std::reverse(convex.begin(), convex.end());
      EXPECT_TRUE(Polygon::Make(convex).ok()) << vertices << " " << phase;
      const auto star = Polygon::Make(Circular(vertices, 2, phase));
      EXPECT_THAT(star.status().message(), ::testing::HasSubstr("crosses itself"))
          << vertices << " " << phase;
    }
  }
}

struct Refused {
  const char* what;
  Ring outer;
  std::vector<Ring> holes;
  const char* message;
};

class PolygonRefusalTest : public ::testing::TestWithParam<Refused> {};

TEST_P(PolygonRefusalTest, NamesTheRingAndThePlace) {
  const auto polygon = Polygon::Make(GetParam().outer, GetParam().holes);
  ASSERT_FALSE(polygon.ok());
  EXPECT_EQ(polygon.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(polygon.status().message()), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    , PolygonRefusalTest,
    ::testing::Values(
        Refused{"NoVertex", {}, {}, "outer has fewer than 3 distinct vertices"},
        Refused{"TwoVertices", {{0, 0}, {1, 1}}, {}, "outer has fewer than 3 distinct vertices"},
        Refused{"TwoVerticesInTurns",
                {{0, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 0}},
                {},
                "outer has fewer than 3 distinct vertices"},
        Refused{"Nan", {{0, 0}, {1, 0}, {1, 1}, {0, kNan}}, {}, "outer[3] is not finite"},
        // Vertices are counted as given, including repeated ones.
        Refused{"Inf", {{0, 0}, {0, 0}, {0, 0}, {kInf, 1}}, {}, "outer[3] is not finite"},
        Refused{"InfInHole",
                kSquare,
                {{{1, 1}, {2, 1}, {2, 2}}, {{1, 1}, {2, -kInf}}},
                "holes[1][1] is not finite"},
        Refused{"FarAway",
                {{0, 0}, {1, 0}, {2e9, 1}},
                {},
                "outer[2] is more than 1e+09 m from the origin"},
        Refused{"SmallHole",
                kSquare,
                {{{1, 1}, {2, 2}, {1, 1}}},
                "holes[0] has fewer than 3 distinct vertices"},
        Refused{"Bowtie",
                {{0, 0}, {3, 4}, {3, 0}, {0, 4}},
                {},
                "outer ring crosses itself at (1.5, 2)"},
        Refused{"Line", {{0, 0}, {1, 1}, {2, 2}}, {}, "outer ring encloses no area"},
        Refused{"Spike",
                {{0, 0}, {4, 0}, {4, 4}, {4, 6}, {4, 4}, {0, 4}},
                {},
                "outer ring touches itself at (4, 4)"},
        Refused{"TouchesItself",
                {{0, 0}, {2, 2}, {4, 0}, {4, 4}, {2, 2}, {0, 4}},
                {},
                "outer ring touches itself at (2, 2)"},
        Refused{"CrossedHole",
                kSquare,
                {{{1, 1}, {2, 1}, {2, 2}}, {{1, 2}, {2, 3}, {2, 2}, {1, 3}}},
                "holes[1] crosses itself at (1.5, 2.5)"},
        Refused{"HoleOutside",
                kSquare,
                {{{5, 5}, {6, 5}, {6, 6}}},
                "holes[0] lies outside of the outer ring at (5, 5)"},
        Refused{"HoleAcross",
                kSquare,
                {{{2, 1}, {6, 1}, {6, 2}}},
                "holes[0] does not stay inside the outer ring at (4, 1)"},
        Refused{"HolesOverlap",
                kSquare,
                {{{1, 1}, {3, 1}, {3, 3}, {1, 3}}, {{2, 2}, {3.5, 2}, {3.5, 3.5}, {2, 3.5}}},
                "holes[0] and holes[1] overlap at (3, 2)"},
        Refused{"HolesShareAnEdge",
                kSquare,
                {{{1, 1}, {2, 1}, {2, 2}, {1, 2}}, {{2, 1}, {3, 1}, {3, 2}, {2, 2}}},
                "holes[0] and holes[1] overlap at (2, 1)"},
        Refused{"HoleInAHole",
                kSquare,
                {{{2, 2}, {2.5, 2}, {2, 2.5}}, {{1, 1}, {3.5, 1}, {3.5, 3.5}, {1, 3.5}}},
                "holes[0] lies inside holes[1] at (2, 2)"},
        Refused{"HoleRoundTheOuterRing",
                kSquare,
                {{{-1, -1}, {5, -1}, {5, 5}, {-1, 5}}},
                "holes[0] lies outside of the outer ring at (-1, -1)"},
        Refused{"HoleFromSideToSide",
                kSquare,
                {{{0, 2}, {2, 1}, {4, 2}, {2, 3}}},
                "holes[0] cuts the polygon apart where it touches the outer ring at (4, 2)"},
        Refused{"RingOfHoles",
                kSquare,
                {{{1, 2}, {2, 1}, {1, 1}}, {{2, 1}, {3, 2}, {3, 1}}, {{1, 2}, {2, 3}, {3, 2}}},
                "holes[2] cuts the polygon apart where it touches holes[1] at (3, 2)"}),
    [](const ::testing::TestParamInfo<Refused>& info) { return info.param.what; });

// Returns `columns` x `rows` square holes of side 0.5 whose lower left corners have whole
// coordinates from 1 on.
std::vector<Ring> GridOfHoles(int columns, int rows) {
  std::vector<Ring> holes;
  for (int row = 1; row <= rows; ++row) {
    for (int column = 1; column <= columns; ++column) {
      const double x = column, y = row;
      holes.push_back({{x, y}, {x, y + 0.5}, {x + 0.5, y + 0.5}, {x + 0.5, y}});
    }
  }
  return holes;
}

// Returns a ring around all of GridOfHoles, with `teeth` teeth below.
Ring ToothedRing(int teeth, double width, double height) {
  Ring ring{{width, 0}, {width, height}, {0, height}, {0, 0}};
  for (int i = 0; i < teeth; ++i) {
    ring.push_back({width * (i + 0.5) / teeth, -1});
    if (i + 1 < teeth) ring.push_back({width * (i + 1) / teeth, 0});
  }
  return ring;
}

TEST(PolygonTest, A4OverlapAmongSixteenThousandHolesNamesBothHoles) {
  const Ring outer = ToothedRing(25'000, 130, 130);
  std::vector<Ring> holes = GridOfHoles(128, 125);
  const auto valid = Polygon::Make(outer, holes);
  ASSERT_TRUE(valid.ok()) << valid.status();
  EXPECT_EQ(valid->num_vertices(), 50'003 + 4 * 16'000);
  for (Point& p : holes[15'000]) p.x -= 0.75;
  EXPECT_EQ(Polygon::Make(outer, holes).status(),
            absl::InvalidArgumentError("holes[14999] and holes[15000] overlap at (24.25, 118)"));
}

TEST(PolygonTest, A4LongCombOfSlantedTeethIsChecked) {
  // The bounding boxes of almost all pairs of edges intersect.
  constexpr int kTeeth = 49'000;
  Ring comb;
  for (int i = 0; i < kTeeth; ++i) {
    comb.push_back({i * 1e-4, i * -1e-4});
    comb.push_back({20 + i * 1e-4, 20 - i * 1e-4});
  }
  // The back of the comb.
  for (const Point& p : {Point{40, -20}, Point{0, -20}}) comb.push_back(p);
  const auto polygon = Polygon::Make(comb);
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_EQ(polygon->num_vertices(), 2 * kTeeth + 2);
  std::swap(comb[kTeeth], comb[kTeeth + 2]);
  EXPECT_THAT(Polygon::Make(comb).status().message(), ::testing::HasSubstr("crosses itself"));
}

TEST(PolygonTest, AreaAndCentroidTakeHolesOut) {
  const auto polygon = Polygon::Make(kSquare, {{{2, 1}, {3, 1}, {3, 3}, {2, 3}}});
  ASSERT_TRUE(polygon.ok()) << polygon.status();
  EXPECT_DOUBLE_EQ(Area(*polygon), 14.0);
  EXPECT_DOUBLE_EQ(Centroid(*polygon).x, (16 * 2.0 - 2 * 2.5) / 14);
  EXPECT_DOUBLE_EQ(Centroid(*polygon).y, 2.0);
}

TEST(PolygonTest, AreaAndCentroidDoNotSufferFarFromTheOrigin) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 100; ++i) {
    // Coordinates have few bits, so that moving them far away is exact.
    const Polygon near = RandomPolygon(rng, {0, 0}, 2.0, 1.0 / 1024);
    const Point offset{1048576.0 * Uniform(rng, 1, 2), -1048576.0};
    const double dx = std::floor(offset.x);
    Rings rings = near.rings();
    for (Ring& ring : rings) {
      for (Point& p : ring) p = {p.x + dx, p.y + offset.y};
    }
    const Polygon far = Polygon::MakeUnchecked(rings);
    EXPECT_NEAR(Area(far), Area(near), 1e-12);
    EXPECT_NEAR(Centroid(far).x - dx, Centroid(near).x, 1e-9);
    EXPECT_NEAR(Centroid(far).y - offset.y, Centroid(near).y, 1e-9);
  }
}

TEST(RunsBackwardsTest, TellsTheWindingOfEachRing) {
  const Ring outer{{0, 0}, {9, 0}, {9, 9}, {0, 9}};
  const Ring hole{{1, 1}, {1, 2}, {2, 2}};
  const auto reversed = [](Ring ring) {
    std::reverse(ring.begin(), ring.end());
    return ring;
  };
  EXPECT_FALSE(RunsBackwards({}));
  EXPECT_FALSE(RunsBackwards({outer}));
  EXPECT_FALSE(RunsBackwards({outer, hole}));
  EXPECT_TRUE(RunsBackwards({reversed(outer)}));
  EXPECT_TRUE(RunsBackwards({outer, reversed(hole)}));
  // A ring that has lost its area has no winding.
  EXPECT_FALSE(RunsBackwards({{{1, 1}, {1, 1}, {1, 1}}}));
  // The first ring winds rightward by no more than the rounding of its area.
  EXPECT_FALSE(RunsBackwards({{{0, 0}, {4, 0}, {4, 1}, {0, -1.0000000001}}}));
}

TEST(PolygonTest, EmptyPolygonHasNothing) {
  const Polygon empty;
  EXPECT_TRUE(empty.empty());
  EXPECT_TRUE(empty.bounds().empty());
  EXPECT_EQ(Area(empty), 0.0);
}

TEST(PolygonTest, FromBoxIsThatBox) {
  const Polygon polygon = Polygon::FromBox({{1, 2}, {3, 5}});
  EXPECT_EQ(polygon, *Polygon::Make({{1, 2}, {3, 2}, {3, 5}, {1, 5}}));
}

}  // namespace
}  // namespace hypermap
