#include "base/admission/pace.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {
namespace {

const SteadyTime kStart = SteadyTime::Now();

int TakeAll(Pace& pace, const std::string& client, SteadyTime now) {
  int taken = 0;
  while (pace.Take(client, now)) ++taken;
  return taken;
}

TEST(PaceTest, BurstAndThenTheRate) {
  Pace pace(100, 10);
  EXPECT_EQ(TakeAll(pace, "a", kStart), 10);
  EXPECT_EQ(TakeAll(pace, "a", kStart + absl::Milliseconds(50)), 5);
  EXPECT_EQ(TakeAll(pace, "a", kStart + absl::Hours(1)), 10);
}

TEST(PaceTest, ClientsHaveBucketsOfTheirOwn) {
  Pace pace(100, 10);
  EXPECT_EQ(TakeAll(pace, "a", kStart), 10);
  EXPECT_EQ(TakeAll(pace, "b", kStart), 10);
}

TEST(PaceTest, RemembersThoseWhoWereFastAmongManyOthers) {
  Pace pace(100, 10);
  EXPECT_EQ(TakeAll(pace, "fast", kStart), 10);
  for (int i = 0; i < 5000; ++i) EXPECT_TRUE(pace.Take(absl::StrCat(i), kStart));
  EXPECT_FALSE(pace.Take("fast", kStart));
}

}  // namespace
}  // namespace hypermap::admission
