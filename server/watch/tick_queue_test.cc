#include "server/watch/tick_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <vector>

namespace hypermap::server {
namespace {

constexpr absl::Duration kTurn = absl::Milliseconds(10);

// Promises are declared before the threads that fulfil them, so that they outlive these: a waiting
// thread may go on before set_value has returned.
TEST(TickQueueTest, RunsEachTaskOnceInTheirOrder) {
  std::promise<void> done[3];
  WorkerPool workers("hm-test", 1);
  TimerQueue timers;
  const auto queue = TickQueue::Make(absl::Milliseconds(2), kTurn, &timers, &workers);
  std::vector<int> ran;
  for (std::promise<void>& round : done) {
    for (int i = 0; i < 5; ++i) queue->Add([&ran, i] { ran.push_back(i); });
    queue->Add([&round] { round.set_value(); });
    round.get_future().wait();
  }
  EXPECT_THAT(ran, ::testing::ElementsAre(0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1, 2, 3, 4));
  EXPECT_FALSE(queue->RunNext());
}

TEST(TickQueueTest, NothingIsDoneBeforeTheTick) {
  WorkerPool workers("hm-test", 1);
  TimerQueue timers;
  const auto queue = TickQueue::Make(absl::Hours(1000), kTurn, &timers, &workers);
  queue->Add([] { ADD_FAILURE() << "it is not time yet"; });
  EXPECT_FALSE(queue->RunNext());
}

TEST(TickQueueTest, OthersHelpWhileTheWorkerIsHeldUp) {
  std::promise<void> held, release;
  WorkerPool workers("hm-test", 1);
  TimerQueue timers;
  const auto queue = TickQueue::Make(absl::Milliseconds(2), kTurn, &timers, &workers);
  queue->Add([&] {
    held.set_value();
    release.get_future().wait();
  });
  int helped = 0;
  for (int i = 0; i < 3; ++i) queue->Add([&] { ++helped; });
  held.get_future().wait();
  // The only worker is held up, so that the test ends only if this thread runs the tasks.
  while (helped < 3) queue->RunNext();
  release.set_value();
}

TEST(TickQueueTest, TasksOfManyThreadsAreAllRun) {
  constexpr int kThreads = 4;
  constexpr int kTasks = 500;
  std::atomic<int> ran = 0;
  {
    WorkerPool workers("hm-test", 2);
    TimerQueue timers;
    const auto queue = TickQueue::Make(absl::Microseconds(200), kTurn, &timers, &workers);
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        for (int task = 0; task < kTasks; ++task) {
          queue->Add([&ran] { ++ran; });
          queue->RunNext();
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    while (ran < kThreads * kTasks) std::this_thread::yield();
  }
  EXPECT_EQ(ran, kThreads * kTasks);
}

}  // namespace
}  // namespace hypermap::server
