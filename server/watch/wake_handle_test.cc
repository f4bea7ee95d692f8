#include "server/watch/wake_handle.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace hypermap::server {
namespace {

// Counts the turns that a handle gives.
class WakeHandleTest : public ::testing::Test {
 protected:
  std::atomic<int> on_worker_ = 0;
  std::atomic<int> here_ = 0;
  WakeHandle handle_{[this] { ++on_worker_; }, [this] { ++here_; }};
};

TEST_F(WakeHandleTest, OnlyTheFirstCallbackOfAWaitGivesATurn) {
  handle_.BeginTurn();
  handle_.BeginWait();
  EXPECT_EQ(on_worker_, 0);
  handle_.Wake();
  handle_.Wake();
  handle_.WakeHere();
  EXPECT_EQ(on_worker_, 1);
  EXPECT_EQ(here_, 0);
  handle_.BeginTurn();
  handle_.BeginWait();
  handle_.WakeHere();
  handle_.Wake();
  EXPECT_EQ(on_worker_, 1);
  EXPECT_EQ(here_, 1);
}

TEST_F(WakeHandleTest, ACallbackDuringATurnEndsTheNextWaitAtOnce) {
  handle_.BeginTurn();
  handle_.WakeHere();
  EXPECT_EQ(on_worker_ + here_, 0);
  handle_.BeginWait();
  EXPECT_EQ(on_worker_, 1);
  EXPECT_EQ(here_, 0);
  // The turn that it caused takes account of it.
  handle_.BeginTurn();
  handle_.BeginWait();
  EXPECT_EQ(on_worker_, 1);
}

TEST_F(WakeHandleTest, ManyCallbacksAtOnceGiveOneTurn) {
  constexpr int kRounds = 200;
  for (int round = 1; round <= kRounds; ++round) {
    handle_.BeginTurn();
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i) {
      threads.emplace_back([this, i] { i == 0 ? handle_.WakeHere() : handle_.Wake(); });
    }
    handle_.BeginWait();
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(on_worker_ + here_, round);
  }
}

}  // namespace
}  // namespace hypermap::server
