// Validation and repair of polygons are given up when their caller has gone.
#include <cmath>
#include <numbers>

#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "map/geometry/polygon.h"
#include "map/geometry/repair.h"

namespace hypermap {
namespace {

Ring Comb(int teeth) {
  Ring ring;
  for (int i = 0; i < teeth; ++i) {
    ring.push_back({2.0 * i, 1.0});
    ring.push_back({2.0 * i + 1.0, 0.5});
  }
  ring.push_back({2.0 * teeth, -1.0});
  ring.push_back({0.0, -1.0});
  return ring;
}

// A ring that crosses itself about `points` * `points` / 4 times.
Ring Star(int points) {
  Ring ring;
  for (int i = 0; i < points; ++i) {
    const double angle = 2 * std::numbers::pi * i * (points / 2) / points;
    ring.push_back({std::cos(angle), std::sin(angle)});
  }
  return ring;
}

TEST(GeometryCancellationTest, A4_ValidationOfAPolygonIsGivenUp) {
  const Ring comb = Comb(10'000);
  EXPECT_GT(TimesCancelled([&comb] { return Polygon::Make(comb).status(); }), 3);
}

TEST(GeometryCancellationTest, A5_FillingOfASelfCrossingRingIsGivenUpWithinGeos) {
  const Ring star = Star(61);
  EXPECT_GT(TimesCancelled([&star] { return FillNonZero(star).status(); }), 5);
  // GEOS is as it was.
  const auto filled = FillNonZero(star);
  ASSERT_TRUE(filled.ok()) << filled.status();
  EXPECT_FALSE(filled->empty());
}

}  // namespace
}  // namespace hypermap
