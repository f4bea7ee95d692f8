#include "base/admission/handover.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "base/sync/mutex.h"
#include "tests/support/eventually.h"

namespace hypermap::admission {
namespace {

struct SocketPair {
  FileDescriptor client;
  FileDescriptor server;
};

SocketPair MakeSocketPair() {
  int ends[2];
  EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

// Reads from each connection until its client is done, as gRPC does from one that never pauses, or
// has sent kLast, which is answered.
class HandoverTest : public ::testing::Test {
 protected:
  static constexpr char kLast = 'q';

  void SetUp() override {
    auto handover = Handover::Start([this](FileDescriptor socket) {
      {
        const MutexLock lock(&mutex_);
        ++num_given_;
      }
      char byte = 0;
      while (recv(socket.get(), &byte, 1, 0) > 0 && byte != kLast) continue;
      send(socket.get(), &byte, 1, MSG_NOSIGNAL);
    });
    ASSERT_TRUE(handover.ok()) << handover.status();
    handover_ = *std::move(handover);
  }

  bool EventuallyGiven(int num) {
    return testing::Eventually([&] {
      handover_->Attend();
      const MutexLock lock(&mutex_);
      return num_given_ == num;
    });
  }

  Mutex mutex_;
  int num_given_ = 0;
  std::unique_ptr<Handover> handover_;
};

TEST_F(HandoverTest, ConnectionThatKeepsItsThreadHoldsUpNoOther) {
  SocketPair flood = MakeSocketPair();
  SocketPair honest = MakeSocketPair();
  handover_->Give(std::move(flood.server));
  EXPECT_TRUE(EventuallyGiven(1));
  handover_->Give(std::move(honest.server));
  EXPECT_TRUE(EventuallyGiven(2));
}

TEST_F(HandoverTest, AsManyAsThereAreThreadsKeepOthersWaitingUntilOneEnds) {
  std::vector<SocketPair> floods;
  for (int i = 0; i < Handover::kMaxThreads; ++i) {
    floods.push_back(MakeSocketPair());
    handover_->Give(std::move(floods.back().server));
  }
  EXPECT_TRUE(EventuallyGiven(Handover::kMaxThreads));
  SocketPair honest = MakeSocketPair();
  handover_->Give(std::move(honest.server));
  floods.pop_back();
  EXPECT_TRUE(EventuallyGiven(Handover::kMaxThreads + 1));
}

TEST_F(HandoverTest, EndsAlthoughConnectionsKeepItsThreads) {
  SocketPair flood = MakeSocketPair();
  handover_->Give(std::move(flood.server));
  EXPECT_TRUE(EventuallyGiven(1));
  handover_.reset();
  char byte = 0;
  EXPECT_EQ(recv(flood.client.get(), &byte, 1, 0), 0);
}

// gRPC may serve the first call of a connection on the thread that gives it.
TEST_F(HandoverTest, WhatIsServedAtTheEndIsAnswered) {
  SocketPair honest = MakeSocketPair();
  handover_->Give(std::move(honest.server));
  EXPECT_TRUE(EventuallyGiven(1));
  const std::jthread ending([this] { handover_.reset(); });
  absl::SleepFor(absl::Milliseconds(50));
  ASSERT_EQ(send(honest.client.get(), &kLast, 1, MSG_NOSIGNAL), 1);
  char byte = 0;
  ASSERT_EQ(recv(honest.client.get(), &byte, 1, 0), 1);
  EXPECT_EQ(byte, kLast);
}

}  // namespace
}  // namespace hypermap::admission
