#include "server/services/timer_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace hypermap::server {
namespace {

TEST(TimerQueueTest, RunsTasksByTheirTime) {
  TimerQueue timers;
  std::vector<int> ran;
  std::promise<void> done;
  timers.RunAfter(absl::Milliseconds(30), [&] {
    ran.push_back(3);
    done.set_value();
  });
  timers.RunAfter(absl::Milliseconds(20), [&] { ran.push_back(2); });
  timers.RunAfter(absl::Milliseconds(10), [&] { ran.push_back(1); });
  done.get_future().wait();
  EXPECT_THAT(ran, ::testing::ElementsAre(1, 2, 3));
}

TEST(TimerQueueTest, CancelledTaskIsNotRun) {
  TimerQueue timers;
  bool ran = false;
  std::promise<void> done;
  const TimerQueue::Id cancelled = timers.RunAfter(absl::Milliseconds(5), [&] { ran = true; });
  timers.RunAfter(absl::Milliseconds(20), [&] { done.set_value(); });
  timers.Cancel(cancelled);
  done.get_future().wait();
  timers.Cancel(cancelled);
  EXPECT_FALSE(ran);
}

TEST(TimerQueueTest, TaskMaySetTheNext) {
  TimerQueue timers;
  std::promise<void> done;
  timers.RunAfter(absl::ZeroDuration(),
                  [&] { timers.RunAfter(absl::ZeroDuration(), [&] { done.set_value(); }); });
  done.get_future().wait();
}

TEST(TimerQueueTest, EndsWithoutTheTasksThatAreNotDue) {
  bool ran = false;
  {
    TimerQueue timers;
    timers.RunAfter(absl::Hours(1), [&] { ran = true; });
  }
  EXPECT_FALSE(ran);
}

}  // namespace
}  // namespace hypermap::server
