#include "base/admission/open_connections.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "base/admission/client_host.h"
#include "base/admission/listening_socket.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {
namespace {

constexpr int64_t kMin = 8'192;
// More than a client may send for nothing.
constexpr size_t kSmall = 100'000;
constexpr size_t kLarge = 400'000;

// A connection of this process to itself.
struct Pair {
  FileDescriptor client;
  FileDescriptor server;
  std::string peer;
};

class OpenConnectionsTest : public ::testing::Test {
 protected:
  OpenConnectionsTest() : listening_(*Listen("127.0.0.1:0")) {}

  Pair Connect() {
    Pair pair;
    pair.client = FileDescriptor(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    const int listener = listening_.sockets.front().get();
    EXPECT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(connect(pair.client.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
    size = sizeof address;
    while (!pair.server.is_open()) {
      pair.server = FileDescriptor(accept(listener, reinterpret_cast<sockaddr*>(&address), &size));
    }
    pair.peer = NormalizedPeer(address);
    EXPECT_TRUE(connections_.Add(pair.server.get(), address).ok());
    return pair;
  }

  // Sends bytes and reads them at the other end, as gRPC does.
  static void Send(const Pair& pair, size_t bytes) {
    std::string part(10'000, 'x');
    while (bytes > 0) {
      const size_t size = std::min(bytes, part.size());
      ASSERT_EQ(send(pair.client.get(), part.data(), size, MSG_NOSIGNAL),
                static_cast<ssize_t>(size));
      ASSERT_EQ(recv(pair.server.get(), part.data(), size, MSG_WAITALL),
                static_cast<ssize_t>(size));
      bytes -= size;
    }
  }

  // Sends bytes that wait unread.
  static void SendUnread(const Pair& pair, const std::string& bytes) {
    int before = 0;
    ioctl(pair.server.get(), FIONREAD, &before);
    ASSERT_EQ(send(pair.client.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
    int waiting = 0;
    while (waiting < before + static_cast<int>(bytes.size())) {
      ioctl(pair.server.get(), FIONREAD, &waiting);
    }
  }

  static std::vector<std::string> Peers(const std::vector<ShutDownPeer>& shut_down) {
    std::vector<std::string> peers;
    for (const ShutDownPeer& peer : shut_down) peers.push_back(peer.peer);
    return peers;
  }
  static std::vector<std::string> None() { return {}; }

  ListeningSockets listening_;
  OpenConnections connections_{ConnectionLimits{}};
};

TEST_F(OpenConnectionsTest, OnlyTheLargestUnexplainedBytesAreShutDown) {
  const Pair explained = Connect();
  const Pair small = Connect();
  const Pair large = Connect();
  Send(explained, 2 * kLarge);
  Send(small, kSmall);
  Send(large, kLarge);
  connections_.Account({{explained.peer, {2 * kLarge, 0}}});
  EXPECT_EQ(Peers(connections_.ShutDownBeyond(kLarge)), None());
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), std::vector{large.peer});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), std::vector{small.peer});
  // Nobody is left who has unexplained bytes.
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), None());
}

TEST_F(OpenConnectionsTest, UnexplainedBytesStayAlthoughTheyCameSlowly) {
  const Pair slow = Connect();
  for (int i = 0; i < 20; ++i) {
    Send(slow, kLarge / 20);
    connections_.Account({});
  }
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kLarge / 2)), std::vector{slow.peer});
}

TEST_F(OpenConnectionsTest, ExplanationsAreNotSavedUp) {
  const Pair pair = Connect();
  connections_.Account({{pair.peer, {int64_t{100} * kLarge, 0}}});
  Send(pair, kLarge);
  connections_.Account({});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), std::vector{pair.peer});
}

TEST_F(OpenConnectionsTest, MessagesThatAreExplainedWhenTheyAreCompleteAreForgotten) {
  const Pair pair = Connect();
  for (int i = 0; i < 10; ++i) {
    Send(pair, kLarge);
    connections_.Account({});
    connections_.Account({{pair.peer, {kLarge, 0}}});
  }
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), None());
}

TEST_F(OpenConnectionsTest, BytesThatWaitInTheSocketAreNotCounted) {
  const Pair pair = Connect();
  SendUnread(pair, std::string(kSmall, 'x'));
  connections_.Account({});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), None());
}

TEST_F(OpenConnectionsTest, StreamsWithoutCallsCountWhenTheyStay) {
  const Pair honest = Connect();
  const Pair hoarder = Connect();
  connections_.Account({{honest.peer, {0, 1'000}}});
  connections_.AccountStreams({{honest.peer, 1'000}, {hoarder.peer, 1'000}});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), None());
  connections_.AccountStreams({{honest.peer, 1'000}, {hoarder.peer, 1'000}});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), std::vector{hoarder.peer});
}

TEST_F(OpenConnectionsTest, MessagesThatWereGivenUpAreForgottenWithTheirStreams) {
  const Pair gave_up = Connect();
  const Pair unfinished = Connect();
  Send(gave_up, kLarge);
  Send(unfinished, kLarge);
  connections_.Account({});
  connections_.AccountStreams({{gave_up.peer, 0}, {unfinished.peer, 1}});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), std::vector{unfinished.peer});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin)), None());
}

TEST_F(OpenConnectionsTest, BytesThatWaitAreDroppedWithTheConnection) {
  const Pair pair = Connect();
  SendUnread(pair, std::string(kSmall, 'x'));
  EXPECT_EQ(Peers(connections_.ShutDown({pair.peer}, "of a test")), std::vector{pair.peer});
  char byte = 0;
  EXPECT_EQ(recv(pair.server.get(), &byte, 1, 0), 0);
}

TEST_F(OpenConnectionsTest, MostStreamsWithoutCallsAreShutDown) {
  const Pair honest = Connect();
  const Pair hoarder = Connect();
  const Pair small = Connect();
  for (int i = 0; i < 2; ++i) {
    connections_.AccountStreams({{honest.peer, 99}, {hoarder.peer, 1'000}, {small.peer, 300}});
  }
  EXPECT_GT(connections_.BytesOfUnknownStreams(), 10'000'000);
  const auto none = [](const std::string&) { return false; };
  EXPECT_EQ(Peers(connections_.ShutDownStreams(100, none)), None());
  const auto all = [](const std::string&) { return true; };
  const std::vector<ShutDownPeer> shut_down = connections_.ShutDownStreams(100, all);
  EXPECT_EQ(Peers(shut_down), std::vector{hoarder.peer});
  EXPECT_EQ(shut_down.at(0).num_unknown_streams, 1'000);
  EXPECT_EQ(Peers(connections_.ShutDownStreams(100, all)), std::vector{small.peer});
  EXPECT_EQ(Peers(connections_.ShutDownStreams(100, all)), None());
}

TEST_F(OpenConnectionsTest, FewUnexplainedBytesAreNotWhatTakesTheMemory) {
  const Pair pair = Connect();
  Send(pair, kLarge);
  connections_.Account({});
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin, 2 * kLarge)), None());
  EXPECT_EQ(Peers(connections_.ShutDownLargest(kMin, kLarge / 2)), std::vector{pair.peer});
}

TEST_F(OpenConnectionsTest, StalledConnectionsAreShutDownAndGrowingOnesNot) {
  const Pair stalled = Connect();
  const Pair slow_link = Connect();
  Send(stalled, kSmall);
  Send(slow_link, kSmall);
  connections_.Account({});
  EXPECT_EQ(Peers(connections_.ShutDownStalled(10)), None());
  const SteadyTime deadline = SteadyTime::Now() + absl::Seconds(20);
  std::vector<std::string> shut_down;
  while (shut_down.empty() && SteadyTime::Now() < deadline) {
    Send(slow_link, 10'000);
    connections_.Account({});
    shut_down = Peers(connections_.ShutDownStalled(10));
    absl::SleepFor(absl::Milliseconds(20));
  }
  EXPECT_EQ(shut_down, std::vector{stalled.peer});
}

TEST_F(OpenConnectionsTest, BlockOfHeadersInManyFramesIsShutDownAtTheFirstLook) {
  const Pair honest = Connect();
  const Pair flood = Connect();
  const std::string header("\x00\x10\x00\x09\x00\x00\x00\x00\x01", 9);
  std::string frames;
  for (int i = 0; i < 12; ++i) frames += header + std::string(4'096, 'x');
  SendUnread(honest, std::string(20'000, 'x'));
  SendUnread(flood, frames);
  // On a busy machine the time of one call may be over when it has looked at the other connection.
  std::vector<std::string> shut_down = Peers(connections_.ShutDownFloods());
  if (shut_down.empty()) shut_down = Peers(connections_.ShutDownFloods());
  EXPECT_EQ(shut_down, std::vector{flood.peer});
}

TEST_F(OpenConnectionsTest, FramesThatCarryNothingAreSeenOnlyWhenTheyAreNew) {
  const Pair pair = Connect();
  const std::string settings("\0\0\0\x04\0\0\0\0\0", 9);
  std::string frames;
  for (int i = 0; i < 1'000; ++i) frames += settings;
  SendUnread(pair, frames);
  // The same bytes are looked at once.
  for (int i = 0; i < 20; ++i) EXPECT_EQ(Peers(connections_.ShutDownFloods()), None());
  std::vector<std::string> shut_down;
  for (int i = 0; i < 20 && shut_down.empty(); ++i) {
    SendUnread(pair, settings);
    shut_down = Peers(connections_.ShutDownFloods());
  }
  EXPECT_EQ(shut_down, std::vector{pair.peer});
}

}  // namespace
}  // namespace hypermap::admission
