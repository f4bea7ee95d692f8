#include "base/cancellation/cancellation.h"

#include <gtest/gtest.h>

#include <thread>

#include "absl/time/clock.h"
#include "base/cancellation/testing/cancelled_after.h"

namespace hypermap {
namespace {

TEST(CancellationTest, WorkWithoutACallIsNeverCancelled) {
  EXPECT_EQ(Cancellation::Current(), nullptr);
  EXPECT_FALSE(IsCancelled());
  EXPECT_TRUE(CheckCancelled().ok());
}

TEST(CancellationTest, TheErrorOfTheLookIsReportedAndFinal) {
  int looks = 0;
  Cancellation cancellation(
      [&looks] { return ++looks == 2 ? absl::DeadlineExceededError("late") : absl::OkStatus(); },
      absl::ZeroDuration());
  const ScopedCancellation here(&cancellation);
  EXPECT_TRUE(CheckCancelled().ok());
  EXPECT_TRUE(cancellation.status().ok());
  EXPECT_EQ(CheckCancelled(), absl::DeadlineExceededError("late"));
  EXPECT_TRUE(IsCancelled());
  EXPECT_EQ(CheckCancelled(), absl::DeadlineExceededError("late"));
  EXPECT_EQ(cancellation.status(), absl::DeadlineExceededError("late"));
  EXPECT_EQ(looks, 2);
}

TEST(CancellationTest, LooksAtOnceAndThenOnceInAnInterval) {
  int looks = 0;
  Cancellation cancellation([&looks] { return ++looks, absl::OkStatus(); }, absl::Hours(1));
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(cancellation.IsCancelled());
  EXPECT_EQ(looks, 1);
}

TEST(CancellationTest, MayLookNotBeforeAnInterval) {
  int looks = 0;
  const auto count = [&looks] { return ++looks, absl::OkStatus(); };
  Cancellation cancellation(count, absl::Hours(1), Cancellation::FirstLook::kAfterInterval);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(cancellation.IsCancelled());
  EXPECT_EQ(looks, 0);
  EXPECT_FALSE(cancellation.LookNow());
  EXPECT_EQ(looks, 1);
  Cancellation later(count, absl::Milliseconds(1), Cancellation::FirstLook::kAfterInterval);
  while (looks == 1) later.IsCancelled();
}

TEST(CancellationTest, ThreadTimeEndsWithWorkAndNotWithWaiting) {
  Cancellation::Look look = EndOfThreadTime(absl::Milliseconds(20));
  EXPECT_TRUE(look().ok());
  absl::SleepFor(absl::Milliseconds(30));
  EXPECT_TRUE(look().ok());
  while (look().ok()) continue;
  EXPECT_TRUE(absl::IsDeadlineExceeded(look()));
  EXPECT_TRUE(absl::IsDeadlineExceeded(EndOfThreadTime(absl::ZeroDuration())()));
}

TEST(CancellationTest, ScopesNestAndNullMasks) {
  CancelledAfter outer(0);
  EXPECT_TRUE(IsCancelled());
  {
    const ScopedCancellation to_the_end(nullptr);
    EXPECT_FALSE(IsCancelled());
    CancelledAfter inner(1);
    EXPECT_FALSE(IsCancelled());
    EXPECT_TRUE(IsCancelled());
    EXPECT_EQ(inner.num_looks(), 2);
  }
  EXPECT_EQ(Cancellation::Current(), &outer.cancellation());
  EXPECT_TRUE(IsCancelled());
}

TEST(CancellationTest, OtherThreadsHaveTheirOwn) {
  CancelledAfter here(0);
  bool is_cancelled = true;
  std::thread([&is_cancelled] { is_cancelled = IsCancelled(); }).join();
  EXPECT_FALSE(is_cancelled);
}

TEST(CancellationTest, MayBeHandedToAnotherThread) {
  Cancellation cancellation([] { return absl::CancelledError("gone"); });
  absl::Status status;
  std::thread([&] {
    const ScopedCancellation there(&cancellation);
    status = CheckCancelled();
  }).join();
  EXPECT_EQ(status, absl::CancelledError("gone"));
  EXPECT_EQ(Cancellation::Current(), nullptr);
}

}  // namespace
}  // namespace hypermap
