#include "base/admission/call_rate.h"

#include <gtest/gtest.h>

#include "absl/time/time.h"
#include "base/admission/refusals.h"

namespace hypermap::admission {
namespace {

TEST(CallRateTest, BoundsEachClientForItself) {
  CallRate rate(10.0);
  const SteadyTime start = SteadyTime::Now();
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(rate.Take("a", start).ok());
  EXPECT_TRUE(IsTryLater(rate.Take("a", start)));
  EXPECT_TRUE(rate.Take("b", start).ok());
  const SteadyTime later = start + absl::Milliseconds(101);
  EXPECT_TRUE(rate.Take("a", later).ok());
  EXPECT_FALSE(rate.Take("a", later).ok());
}

TEST(CallRateTest, ZeroBoundsNothing) {
  CallRate rate(0.0);
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(rate.Take("a").ok());
}

}  // namespace
}  // namespace hypermap::admission
