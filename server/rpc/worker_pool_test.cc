#include "server/rpc/worker_pool.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace hypermap::server {
namespace {

TEST(WorkerPool, RunsTasksOfOneThreadInOrderAndAllBeforeItEnds) {
  std::vector<int> ran;
  {
    WorkerPool pool("hm-test", 1);
    for (int i = 0; i < 100; ++i) pool.Run([&ran, i] { ran.push_back(i); });
  }
  ASSERT_EQ(ran.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(ran[i], i);
}

// Reads the origin of a task: "client/connection".
WorkerPool::Origin OriginOf(absl::string_view name) {
  const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(name, '/');
  return {parts.first, parts.second};
}

// Runs tasks of these origins, which come in this order, on one thread. Returns the order in which
// they ran.
std::vector<std::string> OrderOf(const std::vector<std::string>& origins) {
  std::vector<std::string> ran;
  std::promise<void> all_queued;
  {
    WorkerPool pool("hm-test", 1);
    pool.Run([&] { all_queued.get_future().wait(); });
    for (const std::string& origin : origins) {
      pool.Run(OriginOf(origin), [&ran, origin] { ran.push_back(origin); });
    }
    all_queued.set_value();
  }
  return ran;
}

TEST(WorkerPool, A4ClientsTakeTurns) {
  EXPECT_EQ(OrderOf({"greedy/1", "greedy/1", "greedy/1", "modest/1"}),
            (std::vector<std::string>{"greedy/1", "modest/1", "greedy/1", "greedy/1"}));
}

TEST(WorkerPool, A4ManyConnectionsOfAClientHaveTheTurnsOfOneClient) {
  std::vector<std::string> origins;
  for (int port = 1; port <= 270; ++port) origins.push_back("greedy/" + std::to_string(port));
  origins.insert(origins.end(), {"modest/1", "modest/1"});
  const std::vector<std::string> ran = OrderOf(origins);
  ASSERT_EQ(ran.size(), 272u);
  EXPECT_EQ(std::vector<std::string>(ran.begin(), ran.begin() + 5),
            (std::vector<std::string>{"greedy/1", "modest/1", "greedy/2", "modest/1", "greedy/3"}));
}

TEST(WorkerPool, A4ConnectionsOfAClientTakeTurns) {
  EXPECT_EQ(
      OrderOf({"fleet/1", "fleet/1", "fleet/1", "fleet/2", "other/1", "other/1"}),
      (std::vector<std::string>{"fleet/1", "other/1", "fleet/2", "other/1", "fleet/1", "fleet/1"}));
}

TEST(WorkerPool, ClientsThatShareAConnectionTakeTurns) {
  EXPECT_EQ(OrderOf({"greedy/gateway", "greedy/gateway", "modest/gateway"}),
            (std::vector<std::string>{"greedy/gateway", "modest/gateway", "greedy/gateway"}));
}

TEST(WorkerPool, AClientWhoseTasksWaitForASubjectIsPassedOver) {
  std::promise<void> kitchen_is_busy, other_ran;
  std::vector<int> in_kitchen;
  {
    WorkerPool pool("hm-test", 2);
    pool.Run({"fleet", "1"}, "kitchen", [&] {
      kitchen_is_busy.set_value();
      other_ran.get_future().wait();
    });
    kitchen_is_busy.get_future().wait();
    for (int port = 2; port <= 20; ++port) {
      pool.Run({"fleet", std::to_string(port)}, "kitchen",
               [&, port] { in_kitchen.push_back(port); });
    }
    // Comes last, and runs while the subject of all others is busy.
    pool.Run({"other", "1"}, "hall", [&] { other_ran.set_value(); });
  }
  ASSERT_EQ(in_kitchen.size(), 19u);
  for (int i = 0; i < 19; ++i) EXPECT_EQ(in_kitchen[i], i + 2);
}

TEST(WorkerPool, ThreadsHaveItsName) {
  char name[16] = "";
  {
    WorkerPool pool("hm-test", 1);
    pool.Run([&] { pthread_getname_np(pthread_self(), name, sizeof name); });
  }
  EXPECT_STREQ(name, "hm-test");
}

TEST(WorkerPool, TasksAboutOneSubjectTakeOneThread) {
  std::promise<void> other_ran;
  std::atomic<int> running = 0, ran = 0;
  {
    WorkerPool pool("hm-test", 2);
    // The first one of them waits for a task of the same client about something else.
    pool.Run({"client 0", ""}, "kitchen", [&] { other_ran.get_future().wait(); });
    for (int i = 1; i <= 20; ++i) {
      pool.Run({"client " + std::to_string(i), ""}, "kitchen", [&] {
        EXPECT_EQ(++running, 1);
        std::this_thread::yield();
        --running;
        ++ran;
      });
    }
    pool.Run({"client 0", ""}, "hall", [&] { other_ran.set_value(); });
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
  WorkerPool pool("hm-test", 1);
  pool.Run([held = std::move(held)] {});
  freed.wait();
}

TEST(WorkerPool, RunsAsManyAtATimeAsThereAreThreads) {
  std::promise<void> first_runs, second_runs;
  WorkerPool pool("hm-test", 2);
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
  WorkerPool pool("hm-test", 1);
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
