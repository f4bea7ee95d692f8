#include "server/session/placement_meters.h"

#include "gtest/gtest.h"

namespace hypermap::server {
namespace {

const SteadyTime kStart = SteadyTime::Now();

SteadyTime At(int seconds) { return kStart + absl::Seconds(seconds); }

TEST(PlacementMetersTest, AFollowerIsBehindSinceItLacksARevision) {
  PlacementMeters meters;
  EXPECT_EQ(meters.LagOf("site", 5, At(0)).revisions, 0);
  meters.NoteLag("site", /*shown=*/5, /*stored=*/5, At(0));
  EXPECT_EQ(meters.LagOf("site", 5, At(9)).time, absl::ZeroDuration());
  meters.NoteLag("site", 5, 7, At(10));
  meters.NoteLag("site", 5, 9, At(11));
  EXPECT_EQ(meters.LagOf("site", 5, At(13)).revisions, 4);
  EXPECT_EQ(meters.LagOf("site", 5, At(13)).time, absl::Seconds(3));
  EXPECT_EQ(meters.LagOf("other", 5, At(13)).revisions, 0);
}

TEST(PlacementMetersTest, AFollowerThatGoesOnIsNotBehindForLong) {
  PlacementMeters meters;
  // It always lacks what is new, and never anything for more than a second.
  for (int second = 0; second < 10; ++second) {
    meters.NoteLag("site", /*shown=*/10 * second, /*stored=*/10 * (second + 1), At(second));
  }
  EXPECT_EQ(meters.LagOf("site", 95, At(10)).revisions, 5);
  EXPECT_EQ(meters.LagOf("site", 95, At(10)).time, absl::Seconds(1));
  EXPECT_EQ(meters.LagOf("site", 100, At(20)).time, absl::ZeroDuration());
}

TEST(PlacementMetersTest, AMapThatIsNotFollowedIsNotBehind) {
  PlacementMeters meters;
  meters.NoteLag("site", 5, 7, At(0));
  meters.ForgetLag("site");
  EXPECT_EQ(meters.LagOf("site", 5, At(9)).revisions, 0);
}

}  // namespace
}  // namespace hypermap::server
