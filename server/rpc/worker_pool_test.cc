#include "server/rpc/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace hypermap::server {
namespace {

TEST(WorkerPool, RunsTasksOfOneThreadInOrderAndAllBeforeItEnds) {
  std::vector<int> ran;
  {
    WorkerPool pool(1);
    for (int i = 0; i < 100; ++i) pool.Run([&ran, i] { ran.push_back(i); });
  }
  ASSERT_EQ(ran.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(ran[i], i);
}

TEST(WorkerPool, A4ClientsTakeTurns) {
  std::vector<std::string> ran;
  {
    std::promise<void> all_queued;
    WorkerPool pool(1);
    pool.Run([&] { all_queued.get_future().wait(); });
    for (int i = 0; i < 3; ++i) pool.Run("greedy", [&ran] { ran.push_back("greedy"); });
    pool.Run("modest", [&ran] { ran.push_back("modest"); });
    all_queued.set_value();
  }
  EXPECT_EQ(ran, (std::vector<std::string>{"greedy", "modest", "greedy", "greedy"}));
}

TEST(WorkerPool, TasksAboutOneSubjectTakeOneThread) {
  std::promise<void> other_ran;
  std::atomic<int> running = 0, ran = 0;
  {
    WorkerPool pool(2);
    // The first one of them waits for a task of the same client about something else.
    pool.Run("client 0", "kitchen", [&] { other_ran.get_future().wait(); });
    for (int i = 1; i <= 20; ++i) {
      pool.Run("client " + std::to_string(i), "kitchen", [&] {
        EXPECT_EQ(++running, 1);
        std::this_thread::yield();
        --running;
        ++ran;
      });
    }
    pool.Run("client 0", "hall", [&] { other_ran.set_value(); });
  }
  EXPECT_EQ(ran, 20);
}

TEST(WorkerPool, FreesATaskBeforeItWaitsForTheNext) {
  // Tells when it is destroyed.
  struct Held {
    std::promise<void> freed;
    ~Held() { freed.set_value(); }
  };
  auto held = std::make_shared<Held>();
  std::future<void> freed = held->freed.get_future();
  WorkerPool pool(1);
  pool.Run([held = std::move(held)] {});
  freed.wait();
}

TEST(WorkerPool, RunsAsManyAtATimeAsThereAreThreads) {
  std::promise<void> first_runs, second_runs;
  WorkerPool pool(2);
  pool.Run([&] {
    first_runs.set_value();
    second_runs.get_future().wait();
  });
  first_runs.get_future().wait();
  pool.Run([&] { second_runs.set_value(); });
}

TEST(WorkerPool, TasksMayRunTasks) {
  std::atomic<int> ran = 0;
  std::promise<void> all_ran;
  WorkerPool pool(1);
  pool.Run([&] {
    ++ran;
    pool.Run([&] {
      ++ran;
      all_ran.set_value();
    });
  });
  all_ran.get_future().wait();
  EXPECT_EQ(ran, 2);
}

}  // namespace
}  // namespace hypermap::server
