#include "map/geometry/ring_fault.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>

#include "gtest/gtest.h"
#include "map/geometry/geos_context.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

// Returns whether GEOS, which compares all edges whose boxes intersect, finds the polygon valid.
bool IsValidInGeos(const Rings& rings) {
  const GeosContext& geos = GeosContext::OfThisThread();
  const GeosGeometry polygon = geos.MakePolygon(rings);
  return polygon != nullptr && GEOSisValid_r(geos.handle(), polygon.get()) == 1;
}

// Drops vertices that repeat the one before. Returns whether three are left.
bool DropRepeatedVertices(Ring& ring) {
  ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  return ring.size() >= 3;
}

// A few points of a small grid, in any order.
Ring ScribbledRing(Rng& rng, int side) {
  Ring ring(UniformInt(rng, 3, 7));
  for (Point& p : ring) p = {1.0 * UniformInt(rng, 0, side), 1.0 * UniformInt(rng, 0, side)};
  return ring;
}

// A star around `centre`, with whole coordinates if `snapped`.
Ring StarRing(Rng& rng, const Point& centre, double radius_m, bool snapped) {
  Ring ring(UniformInt(rng, 3, 9));
  for (size_t i = 0; i < ring.size(); ++i) {
    const double angle = 2 * std::numbers::pi * (i + Uniform(rng, 0, 0.9)) / ring.size();
    const double r = radius_m * Uniform(rng, 0.4, 1.0);
    ring[i] = {centre.x + r * std::cos(angle), centre.y + r * std::sin(angle)};
    if (snapped) ring[i] = {std::round(ring[i].x), std::round(ring[i].y)};
  }
  return ring;
}

Rings Scribbles(Rng& rng) {
  Rings rings(UniformInt(rng, 1, 3));
  for (Ring& ring : rings) ring = ScribbledRing(rng, UniformInt(rng, 2, 8));
  return rings;
}

Rings StarsInAStar(Rng& rng, bool snapped) {
  Rings rings{StarRing(rng, {0, 0}, 12, snapped)};
  const int holes = UniformInt(rng, 0, 5);
  for (int i = 0; i < holes; ++i) {
    const Point centre{Uniform(rng, -8, 8), Uniform(rng, -8, 8)};
    rings.push_back(StarRing(rng, centre, Uniform(rng, 1, 5), snapped));
  }
  return rings;
}

// Squares on their corners, which touch their neighbours and the outer ring in corners.
Rings Diamonds(Rng& rng) {
  const int side = UniformInt(rng, 2, 5);
  const double far = 2.0 * side;
  Rings rings{{{0, 0}, {far, 0}, {far, far}, {0, far}}};
  const double filled = Uniform(rng, 0.1, 0.7);
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      if (Uniform(rng, 0, 1) > filled) continue;
      const double x = 2.0 * column + 1, y = 2.0 * row + 1;
      Ring diamond{{x - 1, y}, {x, y - 1}, {x + 1, y}, {x, y + 1}};
      // Half of one touches fewer neighbours.
      if (UniformInt(rng, 0, 2) == 0) diamond.erase(diamond.begin() + UniformInt(rng, 0, 3));
      rings.push_back(std::move(diamond));
    }
  }
  return rings;
}

// Stars around one another.
Rings Nested(Rng& rng) {
  Rings rings;
  for (double radius_m : {20.0, 7.0, 2.5, 0.9}) {
    if (UniformInt(rng, 0, 2) > 0) rings.push_back(StarRing(rng, {0, 0}, radius_m, false));
  }
  if (rings.empty()) rings.push_back(StarRing(rng, {0, 0}, 1, false));
  return rings;
}

// Triangles around a common corner, some of them nested or overlapping.
Rings Fan(Rng& rng) {
  Rings rings{{{-10, -10}, {10, -10}, {10, 10}, {-10, 10}}};
  const int triangles = UniformInt(rng, 1, 6);
  for (int i = 0; i < triangles; ++i) {
    Ring ring(3);
    for (Point& p : ring) p = {1.0 * UniformInt(rng, -4, 4), 1.0 * UniformInt(rng, -4, 4)};
    ring[0] = {0, 0};
    rings.push_back(std::move(ring));
  }
  return rings;
}

// Vertices that are on a line but for the last bits.
Rings NearlyFlat(Rng& rng) {
  Rings rings(UniformInt(rng, 1, 2));
  const double slope = Uniform(rng, -2, 2);
  for (Ring& ring : rings) {
    ring.resize(UniformInt(rng, 3, 6));
    for (Point& p : ring) {
      p.x = 1 + UniformInt(rng, 0, 6) / 7.0;
      p.y = 3 + slope * p.x + UniformInt(rng, -2, 2) * 4.5e-16;
    }
  }
  return rings;
}

Rings RandomRings(Rng& rng) {
  switch (UniformInt(rng, 0, 6)) {
    case 0:
      return Scribbles(rng);
    case 1:
      return StarsInAStar(rng, /*snapped=*/true);
    case 2:
      return StarsInAStar(rng, /*snapped=*/false);
    case 3:
      return Diamonds(rng);
    case 4:
      return Fan(rng);
    case 5:
      return Nested(rng);
    default:
      return NearlyFlat(rng);
  }
}

// Changes what must not matter: where rings begin, how they turn, the order of holes, and which
// side is up.
void Shuffle(Rng& rng, Rings& rings) {
  const bool transposed = UniformInt(rng, 0, 1) == 0;
  for (Ring& ring : rings) {
    std::rotate(ring.begin(), ring.begin() + UniformInt(rng, 0, ring.size() - 1), ring.end());
    if (UniformInt(rng, 0, 1) == 0) std::reverse(ring.begin(), ring.end());
    if (!transposed) continue;
    for (Point& p : ring) std::swap(p.x, p.y);
  }
  std::shuffle(rings.begin() + 1, rings.end(), rng);
}

std::string ToText(const Rings& rings) {
  std::string text;
  for (const Ring& ring : rings) {
    text += "\n ";
    for (const Point& p : ring) {
      char vertex[64];
      std::snprintf(vertex, sizeof(vertex), " {%.17g, %.17g},", p.x, p.y);
      text += vertex;
    }
  }
  return text;
}

// Checks that the rings at fault make no valid polygon without the other rings.
void CheckRingsAtFault(const Rings& rings, const RingFault& fault) {
  const Ring wide = {{-1e3, -1e3}, {1e3, -1e3}, {1e3, 1e3}, {-1e3, 1e3}};
  switch (fault.kind) {
    case RingFault::Kind::kTouchesItself:
    case RingFault::Kind::kCrossesItself:
      EXPECT_EQ(fault.ring, fault.other);
      EXPECT_FALSE(IsValidInGeos({rings[fault.ring]}));
      return;
    case RingFault::Kind::kLiesOutside:
      EXPECT_EQ(fault.ring, fault.other);
      EXPECT_TRUE(IsValidInGeos({rings[fault.ring]}));
      EXPECT_FALSE(IsValidInGeos({rings[0], rings[fault.ring]}));
      return;
    case RingFault::Kind::kCrosses:
      EXPECT_LT(fault.other, fault.ring);
      EXPECT_FALSE(IsValidInGeos({rings[fault.other], rings[fault.ring]}));
      EXPECT_FALSE(IsValidInGeos({rings[fault.ring], rings[fault.other]}));
      return;
    case RingFault::Kind::kIsNested:
      EXPECT_FALSE(IsValidInGeos({wide, rings[fault.other], rings[fault.ring]}));
      return;
    case RingFault::Kind::kDisconnects:
      EXPECT_LT(fault.other, fault.ring);
      for (size_t i = 1; i < rings.size(); ++i) {
        EXPECT_TRUE(IsValidInGeos({rings[i]}));
      }
      return;
  }
}

// Products of these coordinates have exponents that doubles do not have.
TEST(RingFaultTest, CoordinatesOfVeryDifferentSizesAreTakenAsTheyAre) {
  const Rings rings = {{{0.0, 0.0},
                        {1.1643010474979226e-302, 2.848097255043832e-306},
                        {2.113706745e-314, -595722320.9921875},
                        {5.24225278e-315, 0.0},
                        {-595821443.5078125, 1.059300298849864e-309}}};
  const auto fault = FindRingFault(rings);
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->kind, RingFault::Kind::kCrossesItself);
}

TEST(RingFaultTest, A4AgreesWithGeosOnRandomRings) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  int num_valid = 0;
  int num_of_kind[6] = {};
  for (int i = 0; i < 30'000 && !::testing::Test::HasFailure(); ++i) {
    Rings rings = RandomRings(rng);
    if (!std::all_of(rings.begin(), rings.end(), DropRepeatedVertices)) continue;
    Shuffle(rng, rings);
    SCOPED_TRACE(ToText(rings));
    const auto fault = FindRingFault(rings);
    EXPECT_EQ(!fault.has_value(), IsValidInGeos(rings));
    if (!fault.has_value()) {
      ++num_valid;
      continue;
    }
    ++num_of_kind[static_cast<int>(fault->kind)];
    CheckRingsAtFault(rings, *fault);
  }
  EXPECT_GT(num_valid, 1'000);
  for (const int n : num_of_kind) EXPECT_GT(n, 20);
}

}  // namespace
}  // namespace hypermap
