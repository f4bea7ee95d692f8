#include "base/sync/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>

#include "absl/time/time.h"

namespace hypermap {
namespace {

TEST(ThreadExecutorTest, StepsFollowEachOtherUntilOneEndsTheLoop) {
  int steps = 0;
  auto loop = ThreadExecutor().Start("hm-test", [&]() -> std::optional<absl::Duration> {
    if (++steps == 3) return std::nullopt;
    return absl::ZeroDuration();
  });
  ASSERT_TRUE(loop.ok()) << loop.status();
  (*loop)->Join();
  EXPECT_EQ(steps, 3);
}

TEST(ThreadExecutorTest, AStepIsDueWhenItsTimeHasPassed) {
  int steps = 0;
  auto loop = ThreadExecutor().Start("hm-test", [&]() -> std::optional<absl::Duration> {
    if (++steps == 2) return std::nullopt;
    return absl::Milliseconds(1);
  });
  ASSERT_TRUE(loop.ok()) << loop.status();
  (*loop)->Join();
  EXPECT_EQ(steps, 2);
}

// Without this, work that arrives during a step would wait until the next wake-up.
TEST(ThreadExecutorTest, AWakeDuringAStepIsNotLost) {
  std::atomic<int> steps = 0;
  std::atomic<bool> woken = false;
  auto loop = ThreadExecutor().Start("hm-test", [&]() -> std::optional<absl::Duration> {
    if (++steps == 2) return std::nullopt;
    while (!woken) std::this_thread::yield();
    return absl::InfiniteDuration();
  });
  ASSERT_TRUE(loop.ok()) << loop.status();
  while (steps == 0) std::this_thread::yield();
  (*loop)->Wake();
  woken = true;
  (*loop)->Join();
  EXPECT_EQ(steps, 2);
}

}  // namespace
}  // namespace hypermap
