#include "server/rpc/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <string>
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
