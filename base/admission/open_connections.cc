#include "base/admission/open_connections.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "base/admission/client_host.h"
#include "base/admission/listening_socket.h"

namespace hypermap::admission {
namespace {

// A flood of resets: bytes that wait to be read, of which so many are looked at; resets among them;
// and how often these are seen within a second before the connection is shut down. A client that
// cancels all its calls once stays below.
constexpr int kLeastWaitingBytes = 1'024;
constexpr size_t kPeekedBytes = 16'384;
constexpr int kManyResets = 12;
constexpr int kTimesManyResets = 4;
// So many calls that begin and are cancelled in the bytes that wait are a flood at the first look.
constexpr int kCertainResets = 60;
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

// Returns the number that begins with the highest byte.
uint32_t StreamOf(absl::string_view bytes) {
  uint32_t stream = 0;
  for (const char byte : bytes.substr(0, sizeof stream)) {
    stream = stream << 8 | static_cast<unsigned char>(byte);
  }
  return stream;
}

struct Resets {
  int count = 0;
  // Those of streams that begin in the same bytes.
  int num_begun_here = 0;
  uint32_t last_stream = 0;
};

// Whether `bytes` hold the header of a HEADERS frame of the stream: its type, any flags, and the
// four bytes of the stream.
bool BeginsStream(absl::string_view bytes, absl::string_view stream) {
  constexpr char kHeaders = 1;
  constexpr size_t kTypeAndFlags = 2;
  for (size_t at = bytes.find(stream); at != bytes.npos; at = bytes.find(stream, at + 1)) {
    if (at >= kTypeAndFlags && bytes[at - kTypeAndFlags] == kHeaders) return true;
  }
  return false;
}

// Finds the RST_STREAM frames of HTTP/2 among `bytes`, which may begin within a frame: the header
// of such a frame (RFC 9113, section 6.4), with a stream of the client later than that of the one
// before, so that other data is not taken for it.
Resets FindResets(absl::string_view bytes) {
  static constexpr absl::string_view kReset("\0\0\x04\x03\0", 5);
  constexpr size_t kHeaderBytes = 9;
  // A call that is begun and cancelled at once takes no more than this.
  constexpr size_t kCallBytes = 1'024;
  Resets resets;
  for (size_t at = bytes.find(kReset); at != bytes.npos && at + kHeaderBytes <= bytes.size();
       at = bytes.find(kReset, at + 1)) {
    const uint32_t stream = StreamOf(bytes.substr(at + kReset.size()));
    if (stream % 2 == 0 || stream <= resets.last_stream) continue;
    resets.last_stream = stream;
    ++resets.count;
    const size_t from = at < kCallBytes ? 0 : at - kCallBytes;
    const absl::string_view before = bytes.substr(from, at - from);
    if (BeginsStream(before, bytes.substr(at + kReset.size(), sizeof stream))) {
      ++resets.num_begun_here;
    }
  }
  return resets;
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
  connections_[socket] = {InodeOf(socket), NormalizedPeer(peer), std::move(host)};
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
  const absl::Time now = absl::Now();
  if (now >= removed_ && now < removed_ + period) return;
  removed_ = now;
  for (auto it = connections_.begin(); it != connections_.end();) {
    const auto here = it++;
    if (InodeOf(here->first) != here->second.inode) Forget(here);
  }
}

bool HasManyResets(int socket) {
  char bytes[kPeekedBytes];
  const ssize_t size = recv(socket, bytes, sizeof bytes, MSG_PEEK | MSG_DONTWAIT);
  return size > 0 && FindResets({bytes, static_cast<size_t>(size)}).count >= kManyResets;
}

std::vector<ShutDownPeer> OpenConnections::ShutDown(const std::vector<std::string>& peers) {
  std::vector<ShutDownPeer> done;
  if (peers.empty()) return done;
  for (const auto& [fd, connection] : connections_) {
    if (std::find(peers.begin(), peers.end(), connection.peer) == peers.end()) continue;
    const FileDescriptor socket(fcntl(fd, F_DUPFD_CLOEXEC, 0));
    if (!socket.is_open() || InodeOf(socket.get()) != connection.inode) continue;
    shutdown(socket.get(), SHUT_RDWR);
    done.push_back({connection.peer, connection.host});
  }
  return done;
}

std::vector<ShutDownPeer> OpenConnections::ShutDownFloods() {
  std::vector<ShutDownPeer> peers;
  const absl::Time now = absl::Now();
  for (auto& [fd, connection] : connections_) {
    if (connection.is_held) continue;
    int waiting = 0;
    if (ioctl(fd, FIONREAD, &waiting) != 0 || waiting < kLeastWaitingBytes) continue;
    // A duplicate, so that the socket stays this one while it is looked at.
    const FileDescriptor socket(fcntl(fd, F_DUPFD_CLOEXEC, 0));
    if (!socket.is_open() || InodeOf(socket.get()) != connection.inode) continue;
    char bytes[kPeekedBytes];
    const ssize_t size = recv(socket.get(), bytes, sizeof bytes, MSG_PEEK | MSG_DONTWAIT);
    if (size <= 0) continue;
    const Resets resets = FindResets({bytes, static_cast<size_t>(size)});
    // The same frames are seen again while the server reads nothing.
    if (resets.count < kManyResets || resets.last_stream <= connection.last_reset_stream) continue;
    connection.last_reset_stream = resets.last_stream;
    if (now < connection.first_resets || now > connection.first_resets + absl::Seconds(1)) {
      connection.first_resets = now;
      connection.num_resets_seen = 0;
    }
    const bool is_certain = resets.num_begun_here >= kCertainResets;
    if (++connection.num_resets_seen < kTimesManyResets && !is_certain) continue;
    shutdown(socket.get(), SHUT_RDWR);
    peers.push_back({connection.peer, connection.host});
  }
  return peers;
}

std::vector<ShutDownPeer> OpenConnections::ShutDownBusiest(int64_t least_bytes) {
  struct Busy {
    // A duplicate, so that the socket stays this one while it is looked at.
    FileDescriptor socket;
    const Connection* connection;
    int64_t bytes;
  };
  std::vector<Busy> busy;
  int64_t most = 0;
  for (auto& [fd, connection] : connections_) {
    FileDescriptor socket(fcntl(fd, F_DUPFD_CLOEXEC, 0));
    if (!socket.is_open() || InodeOf(socket.get()) != connection.inode) continue;
    const int64_t received = ReceivedBytes(socket.get());
    const int64_t bytes = connection.received_bytes < 0 ? 0 : received - connection.received_bytes;
    connection.received_bytes = received;
    most = std::max(most, bytes);
    if (bytes >= least_bytes) busy.push_back({std::move(socket), &connection, bytes});
  }
  std::vector<ShutDownPeer> peers;
  for (const Busy& candidate : busy) {
    if (candidate.bytes < most / 2) continue;
    shutdown(candidate.socket.get(), SHUT_RDWR);
    peers.push_back({candidate.connection->peer, candidate.connection->host});
  }
  return peers;
}

}  // namespace hypermap::admission
