#include "base/admission/connection_listener.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "base/admission/client_host.h"
#include "base/admission/memory.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "tests/support/eventually.h"

namespace hypermap::admission {
namespace {

using ::hypermap::testing::Eventually;
using ::testing::HasSubstr;

constexpr absl::Duration kPatience = absl::Minutes(1);

// Accepts connections and keeps them open.
class ConnectionListenerTest : public ::testing::Test {
 protected:
  void Start(
      const ConnectionLimits& limits, int64_t max_resident_bytes = 0,
      std::function<std::vector<std::string>()> floods = [] { return std::vector<std::string>(); },
      std::function<absl::flat_hash_map<std::string, int64_t>()> open_streams = nullptr) {
    ConnectionListenerOptions options;
    options.address = "127.0.0.1:0";
    options.limits = limits;
    options.max_resident_bytes = max_resident_bytes;
    options.floods = std::move(floods);
    options.open_streams = std::move(open_streams);
    options.kept_bytes = [this] { return kept_bytes_.load(); };
    options.accept = [this](FileDescriptor socket) {
      const MutexLock lock(&mutex_);
      accepted_.push_back(std::move(socket));
    };
    options.log = [this](const std::string& line) {
      const MutexLock lock(&mutex_);
      lines_.push_back(line);
    };
    auto listener = ConnectionListener::Start(std::move(options));
    ASSERT_TRUE(listener.ok()) << listener.status();
    listener_ = *std::move(listener);
  }

  // Returns a closed descriptor if there is none to be had.
  FileDescriptor Connect(const char* from = "127.0.0.1") {
    FileDescriptor client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (!client.is_open()) return client;
    // The port is chosen by connect. Thousands that are chosen by bind would include ports at which
    // servers of other tests are about to listen again.
    const int on = 1;
    EXPECT_EQ(setsockopt(client.get(), IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &on, sizeof on), 0);
    sockaddr_in source{};
    source.sin_family = AF_INET;
    inet_pton(AF_INET, from, &source.sin_addr);
    EXPECT_EQ(bind(client.get(), reinterpret_cast<sockaddr*>(&source), sizeof source), 0);
    sockaddr_in server = source;
    inet_pton(AF_INET, "127.0.0.1", &server.sin_addr);
    int port = 0;
    const absl::string_view address = listener_->address();
    EXPECT_TRUE(absl::SimpleAtoi(address.substr(address.rfind(':') + 1), &port));
    server.sin_port = htons(port);
    EXPECT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&server), sizeof server), 0);
    return client;
  }

  // The client's address, as the listener knows it.
  static std::string AddressOf(const FileDescriptor& client) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    EXPECT_EQ(getsockname(client.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
    return NormalizedPeer(address);
  }
  static bool IsClosed(const FileDescriptor& client) {
    char byte = 0;
    return recv(client.get(), &byte, 1, MSG_DONTWAIT) == 0;
  }

  size_t num_accepted() {
    const MutexLock lock(&mutex_);
    return accepted_.size();
  }
  // Closes all accepted connections, as gRPC does when their clients have gone.
  void CloseAccepted() {
    const MutexLock lock(&mutex_);
    accepted_.clear();
  }
  // Connects until a connection is accepted, which then stays open.
  bool ConnectsAgain() {
    return Eventually([&] {
      const size_t before = num_accepted();
      const int64_t refused = listener_->num_refused();
      last_ = Connect();
      if (!last_.is_open()) {
        // Connections that were accepted after the last CloseAccepted have all descriptors.
        CloseAccepted();
        return false;
      }
      EXPECT_TRUE(Eventually(
          [&] { return num_accepted() > before || listener_->num_refused() > refused; }));
      return num_accepted() > before;
    });
  }

  std::atomic<int64_t> kept_bytes_ = 0;
  Mutex mutex_;
  std::deque<FileDescriptor> accepted_;
  std::deque<std::string> lines_;
  FileDescriptor last_;
  std::unique_ptr<ConnectionListener> listener_;
};

TEST_F(ConnectionListenerTest, A1ConnectionsBeyondTheLimitAreClosedAndLaterOnesAccepted) {
  Start({3, 3});
  std::deque<FileDescriptor> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(Connect());
  EXPECT_TRUE(Eventually([&] { return listener_->num_refused() == 5; }));
  EXPECT_TRUE(Eventually([&] { return num_accepted() == 3; }));
  for (int i = 3; i < 8; ++i) {
    EXPECT_TRUE(Eventually([&] { return IsClosed(clients[i]); })) << i;
  }
  EXPECT_FALSE(IsClosed(clients[0]));
  clients.clear();
  CloseAccepted();
  EXPECT_TRUE(ConnectsAgain());
  const MutexLock lock(&mutex_);
  ASSERT_FALSE(lines_.empty());
  EXPECT_THAT(lines_.front(), HasSubstr("--max_connections, 3, are open"));
}

TEST_F(ConnectionListenerTest, A1OneAddressCantTakeAllConnections) {
  Start({4, 2});
  std::deque<FileDescriptor> clients;
  for (int i = 0; i < 4; ++i) clients.push_back(Connect("127.0.0.2"));
  EXPECT_TRUE(Eventually([&] { return listener_->num_refused() == 2; }));
  clients.push_back(Connect("127.0.0.3"));
  EXPECT_TRUE(Eventually([&] { return num_accepted() == 3; }));
  EXPECT_EQ(listener_->num_refused(), 2);
}

TEST_F(ConnectionListenerTest, A1RunningOutOfFilesIsSurvived) {
  Start({100'000, 100'000});
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit low = before;
  low.rlim_cur = 64;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  // Both ends of the connections take descriptors of this process.
  std::deque<FileDescriptor> clients;
  while (true) {
    FileDescriptor client = Connect();
    if (!client.is_open()) break;
    clients.push_back(std::move(client));
  }
  // Frees one descriptor at a time, so that some connections are made for which none is left.
  for (int i = 0; i < 20; ++i) {
    clients.pop_front();
    clients.push_back(Connect());
  }
  clients.clear();
  CloseAccepted();
  EXPECT_TRUE(ConnectsAgain());
  setrlimit(RLIMIT_NOFILE, &before);
}

TEST_F(ConnectionListenerTest, A2WhoFloodsIsShutDownWhileMemoryIsShort) {
  // More than one byte is always resident.
  Start({10, 10}, 1);
  const FileDescriptor quiet = Connect();
  const FileDescriptor flood = Connect();
  ASSERT_TRUE(Eventually([&] { return num_accepted() == 2; }));
  const std::string bytes(1 << 20, 'x');
  while (listener_->num_shut_down() == 0) {
    // Reads the other end, so that more can be sent.
    std::string read(1 << 20, ' ');
    const ssize_t sent = send(flood.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    const MutexLock lock(&mutex_);
    for (const FileDescriptor& end : accepted_) {
      [[maybe_unused]] const ssize_t n = recv(end.get(), read.data(), read.size(), MSG_DONTWAIT);
    }
    if (sent < 0 && errno != EAGAIN) break;
  }
  EXPECT_TRUE(Eventually([&] { return listener_->num_shut_down() == 1; }));
  EXPECT_FALSE(IsClosed(quiet));
  const MutexLock lock(&mutex_);
  ASSERT_FALSE(lines_.empty());
  EXPECT_THAT(lines_.front(), HasSubstr("connections were shut down"));
}

TEST_F(ConnectionListenerTest, MemoryThatTheServerKeepsIsNotThatOfConnections) {
  kept_bytes_ = int64_t{1} << 40;
  Start({10, 10}, 1);
  const FileDescriptor client = Connect();
  ASSERT_TRUE(Eventually([&] { return num_accepted() == 1; }));
  // Sends until `is_done`, and reads what was sent.
  const auto send_until = [&](const std::function<bool(int64_t)>& is_done) {
    const std::string bytes(1 << 18, 'x');
    std::string read = bytes;
    for (int64_t sent = 0; !is_done(sent);) {
      const ssize_t n = send(client.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (n < 0 && errno != EAGAIN) break;
      sent += std::max<ssize_t>(n, 0);
      const MutexLock lock(&mutex_);
      while (recv(accepted_.front().get(), read.data(), read.size(), MSG_DONTWAIT) > 0) continue;
    }
  };
  send_until([](int64_t sent) { return sent > (64 << 20); });
  EXPECT_EQ(listener_->num_shut_down(), 0);
  kept_bytes_ = 0;
  send_until([&](int64_t /*sent*/) { return listener_->num_shut_down() == 1; });
  EXPECT_TRUE(Eventually([&] { return listener_->num_shut_down() == 1; }));
}

// Returns whether the memory of this program is that of glibc, and not that of a sanitizer.
bool HasAllocatorOfGlibc() {
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  return false;
#endif
#endif
  return true;
}

TEST_F(ConnectionListenerTest, MemoryOfAPeakIsReturnedToTheSystem) {
  if (!HasAllocatorOfGlibc()) GTEST_SKIP() << "sanitizers keep what is freed";
  constexpr int kPieces = 200'000;
  Start({10, 10}, int64_t{1} << 40);
  const FileDescriptor client = Connect();
  ASSERT_TRUE(Eventually([&] { return num_accepted() == 1; }));
  const int64_t before = ResidentMemory();
  std::vector<std::unique_ptr<std::string>> pieces;
  for (int i = 0; i < kPieces; ++i) pieces.push_back(std::make_unique<std::string>(1000, 'x'));
  EXPECT_GT(ResidentMemory(), before + 150'000'000);
  // The last piece stays, so that the allocator can't shorten the heap by itself.
  pieces.erase(pieces.begin(), pieces.end() - 1);
  EXPECT_TRUE(Eventually([&] { return ResidentMemory() < before + 50'000'000; }));
}

// Frames of HTTP/2 that begin a call on a stream and cancel it.
std::string CancelledCall(uint32_t stream) {
  const std::string id{static_cast<char>(stream >> 24), static_cast<char>(stream >> 16),
                       static_cast<char>(stream >> 8), static_cast<char>(stream)};
  return std::string{0, 0, 6, 1, 4} + id + "header" + std::string{0, 0, 4, 3, 0} + id +
         std::string{0, 0, 0, 8};
}

TEST_F(ConnectionListenerTest, A2FloodOfCancelledCallsIsShutDown) {
  Start({10, 10});
  const FileDescriptor quiet = Connect();
  ASSERT_TRUE(Eventually([&] { return num_accepted() == 1; }));
  const FileDescriptor flood = Connect();
  ASSERT_TRUE(Eventually([&] { return num_accepted() == 2; }));
  // Many calls that are cancelled once, and then wait unread with other bytes, are no flood.
  std::string once;
  for (uint32_t i = 0; i < 50; ++i) once += CancelledCall(2 * i + 1);
  once += std::string(5'000, 'x');
  ASSERT_EQ(send(quiet.get(), once.data(), once.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(once.size()));
  uint32_t stream = 1;
  const SteadyTime deadline = SteadyTime::Now() + kPatience;
  while (listener_->num_shut_down() == 0 && SteadyTime::Now() < deadline) {
    std::string frames;
    for (int i = 0; i < 50; ++i, stream += 2) frames += CancelledCall(stream);
    if (send(flood.get(), frames.data(), frames.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) {
      absl::SleepFor(absl::Milliseconds(1));
    }
    // The other end reads the flood, and not the quiet connection.
    const MutexLock lock(&mutex_);
    std::string read(frames.size() / 2, ' ');
    [[maybe_unused]] const ssize_t n =
        recv(accepted_.back().get(), read.data(), read.size(), MSG_DONTWAIT);
  }
  EXPECT_EQ(listener_->num_shut_down(), 1);
  EXPECT_TRUE(Eventually([&] { return IsClosed(flood); }));
  EXPECT_FALSE(IsClosed(quiet));
  const MutexLock lock(&mutex_);
  ASSERT_FALSE(lines_.empty());
  EXPECT_THAT(lines_.front(), HasSubstr("cancelled calls"));
}

TEST_F(ConnectionListenerTest, A2ManyCallsThatAreBegunAndCancelledInOneReadAreAFlood) {
  Start({10, 10});
  const FileDescriptor closes_watches = Connect();
  const FileDescriptor flood = Connect();
  ASSERT_TRUE(Eventually([&] { return num_accepted() == 2; }));
  // A client that ends many old calls at once is honest.
  std::string ends;
  for (uint32_t i = 0; i < 200; ++i) ends += CancelledCall(2 * i + 1).substr(15);
  ASSERT_GT(send(closes_watches.get(), ends.data(), ends.size(), MSG_NOSIGNAL), 0);
  std::string calls;
  for (uint32_t i = 0; i < 200; ++i) calls += CancelledCall(2 * i + 1);
  ASSERT_GT(send(flood.get(), calls.data(), calls.size(), MSG_NOSIGNAL), 0);
  EXPECT_TRUE(Eventually([&] { return listener_->num_shut_down() == 1; }));
  EXPECT_TRUE(Eventually([&] { return IsClosed(flood); }));
  EXPECT_FALSE(IsClosed(closes_watches));
}

// A listener that has shut down a connection of 127.0.0.2 as a flood.
class FloodedListenerTest : public ConnectionListenerTest {
 protected:
  FloodedListenerTest() {
    Start({1'000, 1'000}, 0, [this] {
      const MutexLock lock(&floods_mutex_);
      return floods_;
    });
    const FileDescriptor flood = Connect("127.0.0.2");
    EXPECT_TRUE(Eventually([&] { return num_accepted() == 1; }));
    SetFloods({AddressOf(flood)});
    EXPECT_TRUE(Eventually([&] { return IsClosed(flood); }));
    SetFloods({});
  }
  // Its thread uses the members below.
  ~FloodedListenerTest() override { listener_.reset(); }

 private:
  void SetFloods(std::vector<std::string> peers) {
    const MutexLock lock(&floods_mutex_);
    floods_ = std::move(peers);
  }

  Mutex floods_mutex_;
  std::vector<std::string> floods_;
};

TEST_F(FloodedListenerTest, A2ItsHostIsLookedAtBeforeItsConnectionsAreAccepted) {
  // One that floods before it was accepted is closed.
  std::string frames;
  for (uint32_t i = 0; i < 50; ++i) frames += CancelledCall(2 * i + 1);
  const FileDescriptor again = Connect("127.0.0.2");
  ASSERT_GT(send(again.get(), frames.data(), frames.size(), MSG_NOSIGNAL), 0);
  EXPECT_TRUE(Eventually([&] {
    // The close of a socket with unread bytes resets the connection.
    char byte = 0;
    const ssize_t n = recv(again.get(), &byte, 1, MSG_DONTWAIT);
    return n == 0 || (n < 0 && errno == ECONNRESET);
  }));
  // Others do not wait, and an honest one of the same host is accepted after a while.
  const FileDescriptor other = Connect("127.0.0.3");
  const FileDescriptor honest = Connect("127.0.0.2");
  EXPECT_TRUE(Eventually([&] { return num_accepted() == 3; }));
  EXPECT_FALSE(IsClosed(honest));
}

TEST_F(FloodedListenerTest, ConnectionsOfItsHostThatWaitAreAcceptedOneAfterAnother) {
  const SteadyTime begin = SteadyTime::Now();
  std::vector<FileDescriptor> waiting;
  for (int i = 0; i < 40; ++i) waiting.push_back(Connect("127.0.0.2"));
  size_t accepted = 0;
  EXPECT_TRUE(Eventually([&] {
    accepted = num_accepted() - 1;
    const double most = 20 * absl::ToDoubleSeconds(SteadyTime::Now() - begin);
    EXPECT_LE(static_cast<double>(accepted), most + 1);
    return accepted >= 12;
  }));
}

TEST_F(ConnectionListenerTest, HostWaitsForTheStreamsOfItsEarlierConnections) {
  Mutex mutex;
  absl::flat_hash_map<std::string, int64_t> streams;
  // There is too little memory for any streams.
  Start(
      {100, 100}, 1 << 20, [] { return std::vector<std::string>(); },
      [&] {
        const MutexLock lock(&mutex);
        return streams;
      });
  const auto set_streams = [&](const FileDescriptor& client, int64_t count) {
    const MutexLock lock(&mutex);
    streams[AddressOf(client)] = count;
  };
  const FileDescriptor flood = Connect("127.0.0.2");
  const FileDescriptor honest = Connect("127.0.0.2");
  EXPECT_TRUE(Eventually([&] { return num_accepted() == 2; }));
  const SteadyTime begin = SteadyTime::Now();
  set_streams(flood, 4'000);
  EXPECT_TRUE(Eventually([&] { return IsClosed(flood); }));
  const FileDescriptor next = Connect("127.0.0.2");
  // Others do not wait.
  const FileDescriptor other = Connect("127.0.0.3");
  EXPECT_TRUE(Eventually([&] { return num_accepted() == 4; }));
  // 0.5 ms for each stream.
  EXPECT_GE(SteadyTime::Now() - begin, absl::Seconds(2));
  EXPECT_FALSE(IsClosed(honest));
  // Now memory is not short, and only the host that is known may not have such streams.
  kept_bytes_ = int64_t{1} << 40;
  set_streams(other, 2'000);
  set_streams(next, 200);
  EXPECT_TRUE(Eventually([&] { return IsClosed(next); }));
  EXPECT_FALSE(IsClosed(other));
  // Its thread uses the variables above.
  listener_.reset();
}

TEST_F(ConnectionListenerTest, HostThatConnectsAgainAndAgainIsPaced) {
  Start({10'000, 10'000});
  const SteadyTime begin = SteadyTime::Now();
  constexpr int kConnections = 3000;
  for (int i = 0; i < kConnections; ++i) Connect();
  const size_t before = num_accepted();
  // A burst of 1000 and then 200 per second are accepted, less those that were closed while they
  // waited.
  const double most = 1000 + 200 * absl::ToDoubleSeconds(SteadyTime::Now() - begin);
  EXPECT_LE(static_cast<double>(before), most + 1);
  const FileDescriptor other = Connect("127.0.0.2");
  EXPECT_TRUE(Eventually([&] { return num_accepted() > before; }));
  const FileDescriptor same = Connect();
  EXPECT_TRUE(ConnectsAgain());
}

TEST_F(ConnectionListenerTest, ClosedConnectionsAreNoLongerCounted) {
  Start({10, 10});
  const FileDescriptor first = Connect();
  const FileDescriptor second = Connect();
  EXPECT_TRUE(Eventually([&] { return listener_->num_open() == 2 && num_accepted() == 2; }));
  CloseAccepted();
  EXPECT_TRUE(Eventually([&] { return listener_->num_open() == 0; }));
}

TEST_F(ConnectionListenerTest, StoppedListenerRefusesConnections) {
  Start({10, 10});
  listener_->Stop();
  FileDescriptor client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in server{};
  server.sin_family = AF_INET;
  inet_pton(AF_INET, "127.0.0.1", &server.sin_addr);
  int port = 0;
  const absl::string_view address = listener_->address();
  ASSERT_TRUE(absl::SimpleAtoi(address.substr(address.rfind(':') + 1), &port));
  server.sin_port = htons(port);
  EXPECT_NE(connect(client.get(), reinterpret_cast<sockaddr*>(&server), sizeof server), 0);
}

TEST(ListenTest, TakenPortAndBadAddressesAreRefused) {
  const auto first = Listen("127.0.0.1:0");
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(Listen(first->address).status().code(), absl::StatusCode::kUnavailable);
  for (const char* address : {"", "127.0.0.1", ":", "127.0.0.1:", "127.0.0.1:x", "a b:1"}) {
    EXPECT_EQ(Listen(address).status().code(), absl::StatusCode::kInvalidArgument) << address;
  }
  EXPECT_TRUE(Listen("localhost:0").ok());
}

}  // namespace
}  // namespace hypermap::admission
