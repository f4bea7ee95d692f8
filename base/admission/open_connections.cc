#include "base/admission/open_connections.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/admission/client_host.h"
#include "base/admission/frame_headers.h"
#include "base/admission/listening_socket.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {
namespace {

// A connection is looked at when at least this many bytes wait to be read, and of these the first
// kPeekedBytes.
constexpr int kMinWaitingBytes = 1'024;
constexpr size_t kPeekedBytes = 16'384;
// Most bytes that one call of recv drops.
constexpr size_t kMaxDropped = size_t{1} << 30;
// Number of resets among the waiting bytes, and the number of such looks within a second, at which
// a connection is shut down. A client that cancels all its calls once stays below.
constexpr int kManyResets = 12;
constexpr int kTimesManyResets = 4;
// Number of calls that begin and are cancelled within the waiting bytes, at which a connection is
// shut down at the first look.
constexpr int kCertainResets = 60;
// Number of frames that carry nothing among the waiting bytes, and the number of such looks within
// a second, at which a connection is shut down. A client that reads a large answer in many small
// parts stays below.
constexpr int kManyEmptyFrames = 400;
constexpr int kTimesManyEmptyFrames = 5;
// Number and bytes of CONTINUATION frames of one block of headers that no honest client sends: the
// server refuses headers of more than 16 KiB, which fit into one frame.
constexpr int kManyContinuations = 3;
constexpr int kManyContinuationBytes = 32'768;
// Time that one call spends on looking at waiting bytes.
constexpr absl::Duration kLookTime = absl::Milliseconds(3);
// Bytes for acknowledgements, pings and windows that a client may send in a second, the most that
// it may save up, and what it has at first.
constexpr double kChatterBytesPerSecond = 4'096;
constexpr double kMaxChatterBytes = 65'536;
constexpr double kFirstChatterBytes = 16'384;
// Memory that gRPC takes for a stream of which only the headers have come.
constexpr int64_t kStreamBytes = 16'384;
// A connection whose unexplained bytes grow by less in this time is stalled.
constexpr int64_t kGrowthBytes = 16'384;
constexpr absl::Duration kGrowthTime = absl::Seconds(5);
// Time between removals while new connections are refused.
constexpr absl::Duration kFullRemovalPeriod = absl::Milliseconds(5);

// Returns 0 for a descriptor that is not open.
ino_t InodeOf(int fd) {
  struct stat info {};
  return fstat(fd, &info) == 0 ? info.st_ino : 0;
}

// Returns -1 if the system does not tell.
int64_t ReceivedBytes(int socket) {
  tcp_info info{};
  socklen_t length = sizeof info;
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &length) != 0) return -1;
  return static_cast<int64_t>(info.tcpi_bytes_received);
}

// Shuts down the connection, and drops the bytes that wait: gRPC would go on to read them.
void Abort(int socket) {
  shutdown(socket, SHUT_RDWR);
  while (recv(socket, nullptr, kMaxDropped, MSG_TRUNC | MSG_DONTWAIT) > 0) continue;
}

}  // namespace

absl::Status OpenConnections::Add(int socket, const sockaddr_storage& peer) {
  // An earlier connection with this descriptor must have been closed.
  if (const auto it = connections_.find(socket); it != connections_.end()) Forget(it);
  std::string host = HostOf(peer);
  const auto is_full = [&] {
    const auto it = num_of_host_.find(host);
    const int of_host = it == num_of_host_.end() ? 0 : it->second;
    return size() >= limits_.max_connections || of_host >= limits_.max_connections_per_address;
  };
  if (is_full()) RemoveClosed(kFullRemovalPeriod);
  if (is_full()) {
    const bool all = size() >= limits_.max_connections;
    return absl::ResourceExhaustedError(
        all ? absl::StrCat("--max_connections, ", limits_.max_connections, ", are open")
            : absl::StrCat("--max_connections_per_address, ", limits_.max_connections_per_address,
                           ", are open from ", host));
  }
  ++num_of_host_[host];
  Connection& added = connections_[socket];
  added.inode = InodeOf(socket);
  added.peer = NormalizedPeer(peer);
  added.host = std::move(host);
  added.accounted = SteadyTime::Now();
  added.chatter_bytes = kFirstChatterBytes;
  return absl::OkStatus();
}

void OpenConnections::SetHeld(int socket, bool is_held) {
  const auto it = connections_.find(socket);
  if (it != connections_.end()) it->second.is_held = is_held;
}

void OpenConnections::Forget(Connections::iterator it) {
  const auto host = num_of_host_.find(it->second.host);
  if (--host->second == 0) num_of_host_.erase(host);
  connections_.erase(it);
}

void OpenConnections::RemoveClosed(absl::Duration period) {
  const SteadyTime now = SteadyTime::Now();
  if (now < removed_ + period) return;
  removed_ = now;
  for (auto it = connections_.begin(); it != connections_.end();) {
    const auto here = it++;
    if (InodeOf(here->first) != here->second.inode) Forget(here);
  }
}

bool HasManyResets(int socket) {
  char bytes[kPeekedBytes];
  const ssize_t size = recv(socket, bytes, sizeof bytes, MSG_PEEK | MSG_DONTWAIT);
  return size > 0 && FindResets({bytes, static_cast<size_t>(size)}, 0).count >= kManyResets;
}

bool OpenConnections::ShutDownOne(int fd, Connection* connection) {
  // A duplicate, so that the socket stays this one meanwhile.
  const FileDescriptor socket(fcntl(fd, F_DUPFD_CLOEXEC, 0));
  if (!socket.is_open() || InodeOf(socket.get()) != connection->inode) return false;
  Abort(socket.get());
  connection->is_shut_down = true;
  return true;
}

std::vector<ShutDownPeer> OpenConnections::ShutDown(const std::vector<std::string>& peers,
                                                    absl::string_view reason) {
  std::vector<ShutDownPeer> done;
  if (peers.empty()) return done;
  for (auto& [fd, connection] : connections_) {
    if (std::find(peers.begin(), peers.end(), connection.peer) == peers.end()) continue;
    if (ShutDownOne(fd, &connection)) done.push_back({connection.peer, connection.host, reason});
  }
  return done;
}

void OpenConnections::ShutDownAll() {
  for (auto& [fd, connection] : connections_) ShutDownOne(fd, &connection);
}

bool OpenConnections::SeenOften(Sightings* sightings, int most) {
  const SteadyTime now = SteadyTime::Now();
  if (now > sightings->first + absl::Seconds(1)) *sightings = {0, now};
  return ++sightings->count >= most;
}

absl::string_view OpenConnections::FloodOf(absl::string_view bytes, Connection* connection) {
  const Resets resets = FindResets(bytes.substr(0, kPeekedBytes), kCertainResets);
  // The same frames are seen again while the server reads little.
  if (resets.count >= kManyResets && resets.last_stream > connection->last_reset_stream) {
    connection->last_reset_stream = resets.last_stream;
    const bool often = SeenOften(&connection->resets, kTimesManyResets);
    if (often || resets.num_begun_here >= kCertainResets) {
      return "they flood the server with cancelled calls";
    }
  }
  const ChainedFrames chains = FindChains(bytes);
  if (chains.num_continuations >= kManyContinuations &&
      chains.continuation_bytes >= kManyContinuationBytes) {
    return "they send a block of headers in many frames";
  }
  if (chains.num_empty >= kManyEmptyFrames &&
      SeenOften(&connection->empty_frames, kTimesManyEmptyFrames)) {
    return "they flood the server with frames that carry nothing";
  }
  return "";
}

std::vector<ShutDownPeer> OpenConnections::ShutDownFloods() {
  struct Candidate {
    int fd;
    int waiting;
    int64_t received;
    Connection* connection;
  };
  std::vector<Candidate> candidates;
  for (auto& [fd, connection] : connections_) {
    if (connection.is_held || connection.is_shut_down) continue;
    int waiting = 0;
    if (ioctl(fd, FIONREAD, &waiting) != 0 || waiting < kMinWaitingBytes) continue;
    const int64_t received = ReceivedBytes(fd);
    if (waiting == connection.looked_waiting_bytes &&
        received == connection.looked_received_bytes) {
      continue;
    }
    candidates.push_back({fd, waiting, received, &connection});
  }
  std::vector<ShutDownPeer> peers;
  if (candidates.empty()) return peers;
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.connection->looked < b.connection->looked;
  });
  const std::unique_ptr<char[]> bytes(new char[kMaxChainedBytes]);
  const SteadyTime begin = SteadyTime::Now();
  for (const Candidate& candidate : candidates) {
    const SteadyTime now = SteadyTime::Now();
    if (now > begin + kLookTime) break;
    Connection& connection = *candidate.connection;
    // A duplicate, so that the socket stays this one while it is looked at.
    const FileDescriptor socket(fcntl(candidate.fd, F_DUPFD_CLOEXEC, 0));
    if (!socket.is_open() || InodeOf(socket.get()) != connection.inode) continue;
    connection.looked = now;
    connection.looked_waiting_bytes = candidate.waiting;
    connection.looked_received_bytes = candidate.received;
    const ssize_t size = recv(socket.get(), bytes.get(), kMaxChainedBytes, MSG_PEEK | MSG_DONTWAIT);
    if (size <= 0) continue;
    const absl::string_view reason = FloodOf({bytes.get(), static_cast<size_t>(size)}, &connection);
    if (reason.empty()) continue;
    Abort(socket.get());
    connection.is_shut_down = true;
    peers.push_back({connection.peer, connection.host, reason});
  }
  return peers;
}

void OpenConnections::Account(const absl::flat_hash_map<std::string, Explained>& explained) {
  const SteadyTime now = SteadyTime::Now();
  for (auto& [fd, connection] : connections_) {
    // The bytes that wait come first: those that come meanwhile then count as not waiting, for
    // once.
    int waiting = 0;
    if (ioctl(fd, FIONREAD, &waiting) != 0) continue;
    const int64_t received = ReceivedBytes(fd);
    if (received < connection.received_bytes) continue;
    connection.unexplained_bytes += received - connection.received_bytes;
    connection.received_bytes = received;
    connection.waiting_bytes = waiting;
    if (const auto it = explained.find(connection.peer); it != explained.end()) {
      connection.unexplained_bytes -= it->second.bytes;
      connection.num_calls += it->second.calls;
    }
    const double seconds = std::clamp(absl::ToDoubleSeconds(now - connection.accounted), 0.0, 60.0);
    connection.accounted = now;
    connection.chatter_bytes =
        std::min(connection.chatter_bytes + kChatterBytesPerSecond * seconds, kMaxChatterBytes);
    connection.unexplained_bytes = std::max<int64_t>(connection.unexplained_bytes, 0);
    const int64_t chatter =
        std::min(connection.unexplained_bytes, static_cast<int64_t>(connection.chatter_bytes));
    connection.unexplained_bytes -= chatter;
    connection.chatter_bytes -= static_cast<double>(chatter);

    const int64_t unexplained = Unexplained(connection);
    connection.least_unexplained = std::min(connection.least_unexplained, unexplained);
    if (unexplained >= connection.least_unexplained + kGrowthBytes || unexplained < kGrowthBytes) {
      connection.least_unexplained = unexplained;
      connection.grew = now;
    }
  }
}

void OpenConnections::AccountUnexplained() {
  for (auto& [fd, connection] : connections_) {
    const int64_t received = ReceivedBytes(fd);
    connection.unexplained_bytes = std::max<int64_t>(received - connection.received_bytes, 0);
    connection.received_bytes = received;
    connection.grew = SteadyTime::Now();
  }
}

void OpenConnections::AccountStreams(
    const absl::flat_hash_map<std::string, int64_t>& open_streams) {
  for (auto& [fd, connection] : connections_) {
    const auto it = open_streams.find(connection.peer);
    const int64_t num_open = it == open_streams.end() ? 0 : it->second;
    if (it != open_streams.end() && num_open == 0) connection.unexplained_bytes = 0;
    const int64_t unknown = std::max<int64_t>(num_open - connection.num_calls, 0);
    connection.num_unknown_streams = std::min(unknown, connection.last_unknown_streams);
    connection.last_unknown_streams = unknown;
  }
}

int64_t OpenConnections::Unexplained(const Connection& connection) {
  if (connection.is_shut_down) return 0;
  return std::max<int64_t>(connection.unexplained_bytes - connection.waiting_bytes, 0) +
         connection.num_unknown_streams * kStreamBytes;
}

int64_t OpenConnections::BytesOfUnknownStreams() const {
  int64_t num = 0;
  for (const auto& [fd, connection] : connections_) num += connection.num_unknown_streams;
  return num * kStreamBytes;
}

std::vector<ShutDownPeer> OpenConnections::ShutDownStreams(
    int64_t least, absl::FunctionRef<bool(const std::string& host)> is_of_hosts) {
  std::vector<std::pair<int, Connection*>> found;
  int64_t most = 0;
  for (auto& [fd, connection] : connections_) {
    if (connection.is_shut_down || connection.num_unknown_streams < least) continue;
    if (!is_of_hosts(connection.host)) continue;
    found.emplace_back(fd, &connection);
    most = std::max(most, connection.num_unknown_streams);
  }
  std::vector<ShutDownPeer> peers;
  for (const auto& [fd, connection] : found) {
    if (connection->num_unknown_streams < most / 2 || !ShutDownOne(fd, connection)) continue;
    peers.push_back({connection->peer, connection->host,
                     "they begin calls of which no message comes",
                     connection->num_unknown_streams});
  }
  return peers;
}

int64_t OpenConnections::MostUnexplainedBytes() const {
  int64_t most = 0;
  for (const auto& [fd, connection] : connections_) most = std::max(most, Unexplained(connection));
  return most;
}

std::vector<ShutDownPeer> OpenConnections::ShutDownLargest(int64_t least_bytes, int64_t least_sum) {
  const int64_t most = MostUnexplainedBytes();
  int64_t sum = 0;
  for (const auto& [fd, connection] : connections_) sum += Unexplained(connection);
  if (sum < least_sum) return {};
  return ShutDownBeyond(std::max(least_bytes, most / 2) - 1);
}

std::vector<ShutDownPeer> OpenConnections::ShutDownBeyond(int64_t most_bytes) {
  std::vector<ShutDownPeer> peers;
  for (auto& [fd, connection] : connections_) {
    if (Unexplained(connection) <= most_bytes || !ShutDownOne(fd, &connection)) continue;
    peers.push_back({connection.peer, connection.host,
                     "they hold bytes in memory that make no calls or messages yet"});
  }
  return peers;
}

std::vector<ShutDownPeer> OpenConnections::ShutDownStalled(int most) {
  std::vector<std::pair<SteadyTime, int>> stalled;
  const SteadyTime now = SteadyTime::Now();
  for (const auto& [fd, connection] : connections_) {
    if (Unexplained(connection) < kGrowthBytes || now < connection.grew + kGrowthTime) continue;
    stalled.emplace_back(connection.grew, fd);
  }
  std::sort(stalled.begin(), stalled.end());
  std::vector<ShutDownPeer> peers;
  for (const auto& [grew, fd] : stalled) {
    if (static_cast<int>(peers.size()) >= most) break;
    Connection& connection = connections_.find(fd)->second;
    if (!ShutDownOne(fd, &connection)) continue;
    peers.push_back({connection.peer, connection.host,
                     "they hold unfinished calls or messages in memory and send nothing more"});
  }
  return peers;
}

}  // namespace hypermap::admission
