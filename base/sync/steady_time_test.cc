#include "base/sync/steady_time.h"

#include <gtest/gtest.h>

#include "absl/time/clock.h"
#include "base/sync/deadline.h"

namespace hypermap {
namespace {

TEST(SteadyTimeTest, GoesOn) {
  const SteadyTime begin = SteadyTime::Now();
  absl::SleepFor(absl::Milliseconds(1));
  EXPECT_GE(SteadyTime::Now() - begin, absl::Milliseconds(1));
  EXPECT_LT(begin, SteadyTime::Now());
  EXPECT_LT(SteadyTime::Now(), begin + absl::Hours(1));
  EXPECT_GT(SteadyTime::Now(), begin - absl::Hours(1));
}

TEST(SteadyTimeTest, InfiniteTimesStaySo) {
  const SteadyTime now = SteadyTime::Now();
  EXPECT_LT(SteadyTime::InfinitePast() + absl::Hours(1), now);
  EXPECT_GT(SteadyTime::InfiniteFuture() - absl::Hours(1), now);
  EXPECT_EQ(now - SteadyTime::InfinitePast(), absl::InfiniteDuration());
  EXPECT_EQ(now + absl::InfiniteDuration(), SteadyTime::InfiniteFuture());
}

TEST(DeadlineTest, PassesOnceItsTimeIsOver) {
  const Deadline deadline(absl::Milliseconds(1));
  absl::SleepFor(absl::Milliseconds(2));
  EXPECT_TRUE(deadline.has_passed());
  EXPECT_FALSE(Deadline(absl::Hours(1)).has_passed());
  EXPECT_LE(Deadline(absl::Hours(1)).left(), absl::Hours(1));
}

TEST(DeadlineTest, InfiniteOnesNeverPass) {
  EXPECT_FALSE(Deadline(absl::InfiniteDuration()).has_passed());
  EXPECT_EQ(Deadline(absl::InfiniteDuration()).left(), absl::InfiniteDuration());
}

}  // namespace
}  // namespace hypermap
