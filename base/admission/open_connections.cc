#include "base/admission/open_connections.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/admission/listening_socket.h"

namespace hypermap::admission {
namespace {

// Bytes of an IPv6 address that name the network; a client may choose the rest.
constexpr int kNetworkBytes = 8;
// Time between removals while new connections are refused.
constexpr absl::Duration kFullRemovalPeriod = absl::Milliseconds(5);

// Returns 0 for a descriptor that is not open.
ino_t InodeOf(int fd) {
  struct stat info {};
  return fstat(fd, &info) == 0 ? info.st_ino : 0;
}

std::string Printed(int family, const void* address) {
  char text[INET6_ADDRSTRLEN] = "";
  return inet_ntop(family, address, text, sizeof text) == nullptr ? "unknown" : text;
}

struct Peer {
  std::string host;
  std::string host_and_port;
};

Peer PeerOf(const sockaddr_storage& address) {
  if (address.ss_family == AF_INET) {
    const auto& in = reinterpret_cast<const sockaddr_in&>(address);
    std::string host = Printed(AF_INET, &in.sin_addr);
    return {host, absl::StrCat(host, ":", ntohs(in.sin_port))};
  }
  if (address.ss_family != AF_INET6) return {"unknown", "unknown"};
  const auto& in = reinterpret_cast<const sockaddr_in6&>(address);
  in6_addr network = in.sin6_addr;
  if (!IN6_IS_ADDR_V4MAPPED(&network)) {
    std::memset(network.s6_addr + kNetworkBytes, 0, sizeof network.s6_addr - kNetworkBytes);
  }
  return {Printed(AF_INET6, &network),
          absl::StrCat("[", Printed(AF_INET6, &in.sin6_addr), "]:", ntohs(in.sin6_port))};
}

// Returns -1 if the system does not tell.
int64_t ReceivedBytes(int socket) {
  tcp_info info{};
  socklen_t length = sizeof info;
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &length) != 0) return -1;
  return static_cast<int64_t>(info.tcpi_bytes_received);
}

}  // namespace

absl::Status OpenConnections::Add(int socket, const sockaddr_storage& peer) {
  // An earlier connection with this descriptor must have been closed.
  if (const auto it = connections_.find(socket); it != connections_.end()) Forget(it);
  const auto is_full = [&](const Peer& named) {
    const auto it = num_of_host_.find(named.host);
    const int of_host = it == num_of_host_.end() ? 0 : it->second;
    return size() >= limits_.max_connections || of_host >= limits_.max_connections_per_address;
  };
  Peer named = PeerOf(peer);
  if (is_full(named)) RemoveClosed(kFullRemovalPeriod);
  if (is_full(named)) {
    const bool all = size() >= limits_.max_connections;
    return absl::ResourceExhaustedError(
        all ? absl::StrCat("--max_connections, ", limits_.max_connections, ", are open")
            : absl::StrCat("--max_connections_per_address, ", limits_.max_connections_per_address,
                           ", are open from ", named.host));
  }
  ++num_of_host_[named.host];
  connections_[socket] = {InodeOf(socket), std::move(named.host_and_port), std::move(named.host)};
  return absl::OkStatus();
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

std::vector<std::string> OpenConnections::ShutDownBusiest(int64_t least_bytes) {
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
  std::vector<std::string> peers;
  for (const Busy& candidate : busy) {
    if (candidate.bytes < most / 2) continue;
    shutdown(candidate.socket.get(), SHUT_RDWR);
    peers.push_back(candidate.connection->peer);
  }
  return peers;
}

}  // namespace hypermap::admission
