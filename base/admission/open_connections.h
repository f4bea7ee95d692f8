// The connections that a server has accepted and that are still open.
#ifndef HYPERMAP_BASE_ADMISSION_OPEN_CONNECTIONS_H_
#define HYPERMAP_BASE_ADMISSION_OPEN_CONNECTIONS_H_

#include <sys/socket.h>
#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/time/time.h"

namespace hypermap::admission {

struct ConnectionLimits {
  // Connections that may be open at once.
  int max_connections = 1'000;
  // The same for one address of clients. An IPv6 address stands for its network of 64 bits.
  int max_connections_per_address = 750;
};

// A connection that was shut down: the client's address with its port, and the host to which it
// counts.
struct ShutDownPeer {
  std::string peer;
  std::string host;
};

// Whether the bytes that wait in the socket hold so many RST_STREAM frames of HTTP/2 that no honest
// client sends them at once. They stay unread.
bool HasManyResets(int socket);

// Counts connections that another library owns and closes without a notice. Each is known by its
// descriptor and by the inode of its socket, so that one whose descriptor now belongs to something
// else counts as closed. Not thread-safe.
class OpenConnections {
 public:
  explicit OpenConnections(const ConnectionLimits& limits) : limits_(limits) {}

  // Counts an accepted connection. RESOURCE_EXHAUSTED, naming the flag, if there are too many.
  absl::Status Add(int socket, const sockaddr_storage& peer);

  // Tells whether the connection waits to be accepted. While it does, ShutDownFloods leaves it.
  void SetHeld(int socket, bool is_held);

  // Forgets the connections that were closed, unless it did so less than `period` ago: it takes one
  // system call for each connection.
  void RemoveClosed(absl::Duration period);

  // Shuts down the connections that received the most bytes since the last call: each that received
  // at least half of the largest number, and at least `least_bytes`. Returns their peers. The first
  // call only counts.
  std::vector<ShutDownPeer> ShutDownBusiest(int64_t least_bytes);

  // Shuts down the connections that flood the server with calls that they cancel at once (HTTP/2
  // Rapid Reset, CVE-2023-44487), and returns their peers. Looks at the bytes that the server has
  // not read yet: a connection is shut down when very many calls begin and are cancelled in them,
  // or when they hold many new RST_STREAM frames in several calls of this function within a second.
  // Sees nothing in connections with TLS.
  std::vector<ShutDownPeer> ShutDownFloods();

  // Shuts down the connections of these peers (NormalizedPeer), and returns those that were open.
  std::vector<ShutDownPeer> ShutDown(const std::vector<std::string>& peers);

  int size() const { return static_cast<int>(connections_.size()); }

 private:
  struct Connection {
    ino_t inode = 0;
    // The peer's address with its port, and without.
    std::string peer;
    std::string host;
    bool is_held = false;
    // Bytes received at the last count; -1 before the first.
    int64_t received_bytes = -1;
    // The latest stream that was seen to be reset.
    uint32_t last_reset_stream = 0;
    // How often many resets were seen since `first_resets`.
    int num_resets_seen = 0;
    absl::Time first_resets = absl::InfinitePast();
  };
  using Connections = absl::flat_hash_map<int, Connection>;

  void Forget(Connections::iterator it);

  const ConnectionLimits limits_;
  absl::Time removed_ = absl::InfinitePast();
  Connections connections_;
  absl::flat_hash_map<std::string, int> num_of_host_;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_OPEN_CONNECTIONS_H_
