#include "base/admission/cancelled_calls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/time/time.h"

namespace hypermap::admission {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(CancelledCallsTest, A2ConnectionWithManyIsAFloodOnce) {
  CancelledCalls calls;
  // The count may begin anew meanwhile, when a second is over.
  for (int i = 0; i < 3 * CancelledCalls::kMaxInPeriod; ++i) {
    calls.Count("ipv4:10.0.0.7:4711", absl::Milliseconds(1));
    if (i % 2 == 0) calls.Count("ipv4:10.0.0.7:4712", absl::Seconds(2));
  }
  EXPECT_THAT(calls.TakeFloods(), ElementsAre("10.0.0.7:4711"));
  EXPECT_THAT(calls.TakeFloods(), IsEmpty());
}

TEST(CancelledCallsTest, FewAreNoFlood) {
  CancelledCalls calls;
  for (int i = 0; i < CancelledCalls::kMaxInPeriod; ++i) {
    calls.Count("ipv4:10.0.0.7:4711", absl::ZeroDuration());
  }
  EXPECT_THAT(calls.TakeFloods(), IsEmpty());
}

}  // namespace
}  // namespace hypermap::admission
