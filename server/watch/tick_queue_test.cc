#include "server/watch/tick_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <vector>

namespace hypermap::server {
namespace {

// Promises are declared before the threads that fulfil them, so that they outlive these: a waiting
// thread may go on before set_value has returned.
TEST(TickLineTest, RunsEachTaskOnceInTheirOrder) {
  std::promise<void> done[3];
  WorkerPool workers(1);
  TimerQueue timers;
  const auto line = TickLine::Make(absl::Milliseconds(2), &timers, &workers);
  std::vector<int> ran;
  for (std::promise<void>& round : done) {
    for (int i = 0; i < 5; ++i) line->Add([&ran, i] { ran.push_back(i); });
    line->Add([&round] { round.set_value(); });
    round.get_future().wait();
  }
  EXPECT_THAT(ran, ::testing::ElementsAre(0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1, 2, 3, 4));
  EXPECT_FALSE(line->RunNext());
}

TEST(TickLineTest, NothingIsDoneBeforeTheTick) {
  WorkerPool workers(1);
  TimerQueue timers;
  const auto line = TickLine::Make(absl::Hours(1000), &timers, &workers);
  line->Add([] { ADD_FAILURE() << "it is not time yet"; });
  EXPECT_FALSE(line->RunNext());
}

TEST(TickLineTest, OthersHelpWhileTheWorkerIsHeldUp) {
  std::promise<void> held, release;
  WorkerPool workers(1);
  TimerQueue timers;
  const auto line = TickLine::Make(absl::Milliseconds(2), &timers, &workers);
  line->Add([&] {
    held.set_value();
    release.get_future().wait();
  });
  int helped = 0;
  for (int i = 0; i < 3; ++i) line->Add([&] { ++helped; });
  held.get_future().wait();
  // The only worker is held up, so that the test ends only if this thread runs the tasks.
  while (helped < 3) line->RunNext();
  release.set_value();
}

TEST(TickLineTest, TasksOfManyThreadsAreAllRun) {
  constexpr int kThreads = 4;
  constexpr int kTasks = 500;
  std::atomic<int> ran = 0;
  {
    WorkerPool workers(2);
    TimerQueue timers;
    const auto line = TickLine::Make(absl::Microseconds(200), &timers, &workers);
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        for (int task = 0; task < kTasks; ++task) {
          line->Add([&ran] { ++ran; });
          line->RunNext();
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
