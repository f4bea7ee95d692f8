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

TEST(WorkerPool, A4ClientsTakeTurns) {
  std::vector<std::string> ran;
  {
    std::promise<void> all_queued;
    WorkerPool pool("hm-test", 1);
    pool.Run([&] { all_queued.get_future().wait(); });
    for (int i = 0; i < 3; ++i) pool.Run("greedy", [&ran] { ran.push_back("greedy"); });
    pool.Run("modest", [&ran] { ran.push_back("modest"); });
    all_queued.set_value();
  }
  EXPECT_EQ(ran, (std::vector<std::string>{"greedy", "modest", "greedy", "greedy"}));
}

// Runs the tasks of these clients, which come in this order, on one thread. Returns the order in
// which they ran.
std::vector<std::string> OrderOf(const std::vector<std::string>& clients) {
  std::vector<std::string> ran;
  std::promise<void> all_queued;
  {
    WorkerPool pool("hm-test", 1);
    pool.Run([&] { all_queued.get_future().wait(); });
    for (const std::string& client : clients) {
      pool.Run(client, [&ran, client] { ran.push_back(client); });
    }
    all_queued.set_value();
  }
  return ran;
}

TEST(WorkerPool, A4ManyConnectionsOfAHostHaveTheTurnsOfOneHost) {
  std::vector<std::string> clients;
  for (int port = 1; port <= 270; ++port) {
    clients.push_back("ipv4:10.0.0.1:" + std::to_string(port));
  }
  clients.insert(clients.end(), {"ipv4:10.0.0.2:1", "ipv4:10.0.0.2:1"});
  const std::vector<std::string> ran = OrderOf(clients);
  ASSERT_EQ(ran.size(), 272u);
  EXPECT_EQ(std::vector<std::string>(ran.begin(), ran.begin() + 5),
            (std::vector<std::string>{"ipv4:10.0.0.1:1", "ipv4:10.0.0.2:1", "ipv4:10.0.0.1:2",
                                      "ipv4:10.0.0.2:1", "ipv4:10.0.0.1:3"}));
}

TEST(WorkerPool, A4ConnectionsOfAHostTakeTurns) {
  const std::string greedy = "ipv4:10.0.0.1:1", modest = "ipv4:10.0.0.1:2";
  const std::string other = "ipv4:10.0.0.2:1";
  EXPECT_EQ(OrderOf({greedy, greedy, greedy, modest, other, other}),
            (std::vector<std::string>{greedy, other, modest, other, greedy, greedy}));
}

TEST(WorkerPool, AddressesOfOneIpv6NetworkAreOneHost) {
  const std::string first = "ipv6:%5B2001:db8::1%5D:1", second = "ipv6:%5B2001:db8::2%5D:1";
  const std::string other = "ipv6:%5B2001:db8:0:1::1%5D:1";
  EXPECT_EQ(OrderOf({first, second, other}), (std::vector<std::string>{first, other, second}));
}

TEST(WorkerPool, AHostWhoseTasksWaitForASubjectIsPassedOver) {
  std::promise<void> kitchen_is_busy, other_ran;
  std::vector<int> in_kitchen;
  {
    WorkerPool pool("hm-test", 2);
    pool.Run("ipv4:10.0.0.1:1", "kitchen", [&] {
      kitchen_is_busy.set_value();
      other_ran.get_future().wait();
    });
    kitchen_is_busy.get_future().wait();
    for (int port = 2; port <= 20; ++port) {
      pool.Run("ipv4:10.0.0.1:" + std::to_string(port), "kitchen",
               [&, port] { in_kitchen.push_back(port); });
    }
    // Comes last, and runs while the subject of all others is busy.
    pool.Run("ipv4:10.0.0.2:1", "hall", [&] { other_ran.set_value(); });
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
