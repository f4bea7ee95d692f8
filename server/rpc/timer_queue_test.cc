#include "server/rpc/timer_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace hypermap::server {
namespace {

// A queue whose thread is held up, so that all timers are set before any of them runs.
class HeldTimers {
 public:
  HeldTimers() {
    timers_.RunAfter(absl::ZeroDuration(), [this] { release_.get_future().wait(); });
  }

  TimerQueue* operator->() { return &timers_; }

  // Returns when all tasks that are due within `delay` have run.
  void RunAllWithin(absl::Duration delay) {
    timers_.RunAfter(delay, [this] { done_.set_value(); });
    release_.set_value();
    done_.get_future().wait();
  }

 private:
  // Declared before the queue, whose thread fulfils them: this thread may go on before set_value
  // has returned.
  std::promise<void> release_, done_;
  TimerQueue timers_;
};

TEST(TimerQueueTest, RunsTasksByTheirTime) {
  std::vector<int> ran;
  HeldTimers timers;
  timers->RunAfter(absl::Milliseconds(450), [&] { ran.push_back(3); });
  timers->RunAfter(absl::Milliseconds(300), [&] { ran.push_back(2); });
  timers->RunAfter(absl::Milliseconds(150), [&] { ran.push_back(1); });
  timers.RunAllWithin(absl::Milliseconds(500));
  EXPECT_THAT(ran, ::testing::ElementsAre(1, 2, 3));
}

TEST(TimerQueueTest, CancelledTaskIsNotRun) {
  bool ran = false;
  HeldTimers timers;
  const TimerQueue::Id cancelled = timers->RunAfter(absl::Milliseconds(5), [&] { ran = true; });
  timers->Cancel(cancelled);
  timers.RunAllWithin(absl::Milliseconds(20));
  timers->Cancel(cancelled);
  EXPECT_FALSE(ran);
}

TEST(TimerQueueTest, TaskMaySetTheNext) {
  std::promise<void> done;
  TimerQueue timers;
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
