// The connections that a server has accepted and that are still open.
#ifndef HYPERMAP_BASE_ADMISSION_OPEN_CONNECTIONS_H_
#define HYPERMAP_BASE_ADMISSION_OPEN_CONNECTIONS_H_

#include <sys/socket.h>
#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/admission/explained_bytes.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

struct ConnectionLimits {
  // Connections that may be open at once.
  int max_connections = 1'000;
  // The same for one address of clients. An IPv6 address stands for its network of 64 bits.
  int max_connections_per_address = 750;
};

// A connection that was shut down: the client's address with its port, the host to which it counts,
// why ("they ..."), and the streams without a call that it had at the last AccountStreams.
struct ShutDownPeer {
  std::string peer;
  std::string host;
  absl::string_view reason;
  int64_t num_unknown_streams = 0;
};

// Returns whether the bytes that wait in the socket hold so many RST_STREAM frames of HTTP/2 that
// no honest client sends them at once. They stay unread.
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

  // Counts the bytes that each connection has received and that the server has not seen as calls or
  // messages: the unexplained bytes. Of these, 4 KiB a second are taken for acknowledgements, pings
  // and windows. `explained` is what was explained since the last call, taken before this call; an
  // explanation that is larger than what is unexplained is not saved up. Takes two system calls for
  // each connection.
  void Account(const absl::flat_hash_map<std::string, Explained>& explained);
  // The same for a server that explains nothing: all bytes are explained when this is called again.
  void AccountUnexplained();
  // Tells how many streams of HTTP/2 are open in each connection (NormalizedPeer). Those beyond the
  // calls that the server knows count as unexplained bytes when they are told twice in a row. The
  // unexplained bytes of a connection without streams are forgotten: they were of messages that
  // their client gave up, or that gRPC refused.
  void AccountStreams(const absl::flat_hash_map<std::string, int64_t>& open_streams);

  // The most unexplained bytes of one connection.
  int64_t MostUnexplainedBytes() const;
  // The memory of gRPC that these streams take, in all connections.
  int64_t BytesOfUnknownStreams() const;

  // The following shut down connections, drop the bytes that wait in their sockets, and return
  // their peers. Bytes that wait in the socket are not counted.

  // Shuts down the connections that have at least `least_bytes` unexplained bytes, and half of the
  // largest number; none if all together have less than `least_sum`.
  std::vector<ShutDownPeer> ShutDownLargest(int64_t least_bytes, int64_t least_sum = 0);
  // Shuts down the connections of the hosts that have at least `least` streams without a call, and
  // half of the largest number.
  std::vector<ShutDownPeer> ShutDownStreams(
      int64_t least, absl::FunctionRef<bool(const std::string& host)> is_of_hosts);
  // Shuts down up to `most` connections that have unexplained bytes, at least 16 KiB, of which less
  // than 16 KiB came in the last 5 s. Begins with those for which this has been true for longest.
  std::vector<ShutDownPeer> ShutDownStalled(int most);
  // Shuts down the connections that have more than `most_bytes` unexplained bytes.
  std::vector<ShutDownPeer> ShutDownBeyond(int64_t most_bytes);

  // Shuts down the connections that flood the server, and returns their peers. Looks at the bytes
  // that the server has not read yet, if others wait than at the last look, and stops after 3 ms;
  // those that were not looked at come first the next time. A connection is shut down
  // - for calls that it cancels at once (HTTP/2 Rapid Reset, CVE-2023-44487): when very many calls
  //   begin and are cancelled in these bytes, or when they hold many new RST_STREAM frames in
  //   several looks within a second;
  // - for 32 KiB of a block of headers in three or more CONTINUATION frames (CVE-2023-33953);
  // - for hundreds of frames that carry nothing, in several looks within a second.
  // Sees nothing in connections with TLS.
  std::vector<ShutDownPeer> ShutDownFloods();

  // Shuts down the connections of these peers (NormalizedPeer), and returns those that were open.
  std::vector<ShutDownPeer> ShutDown(const std::vector<std::string>& peers,
                                     absl::string_view reason);

  // Shuts down all that are open.
  void ShutDownAll();

  int size() const { return static_cast<int>(connections_.size()); }

 private:
  // How often something was seen since `first`.
  struct Sightings {
    int count = 0;
    SteadyTime first = SteadyTime::InfinitePast();
  };
  struct Connection {
    ino_t inode = 0;
    // The peer's address with its port, and without.
    std::string peer;
    std::string host;
    bool is_held = false;
    bool is_shut_down = false;

    // Bytes at the last account: all that were received; those that wait in the socket; those that
    // the server has not seen.
    int64_t received_bytes = 0;
    int64_t waiting_bytes = 0;
    int64_t unexplained_bytes = 0;
    SteadyTime accounted = SteadyTime::InfinitePast();
    // Bytes that are taken for acknowledgements, pings and windows.
    double chatter_bytes = 0;
    // Calls that the server knows; streams beyond these now, and at the last two accounts.
    int64_t num_calls = 0;
    int64_t last_unknown_streams = 0;
    int64_t num_unknown_streams = 0;
    // The fewest unexplained bytes since they last grew.
    int64_t least_unexplained = 0;
    SteadyTime grew = SteadyTime::InfinitePast();

    // Bytes at the last look for floods.
    int64_t looked_received_bytes = -1;
    int looked_waiting_bytes = -1;
    SteadyTime looked = SteadyTime::InfinitePast();
    // The latest stream that was seen to be reset.
    uint32_t last_reset_stream = 0;
    Sightings resets;
    Sightings empty_frames;
  };
  using Connections = absl::flat_hash_map<int, Connection>;

  void Forget(Connections::iterator it);
  // Counts something that was seen; returns whether it was seen `most` times within a second.
  static bool SeenOften(Sightings* sightings, int most);
  // Returns what the connection takes of gRPC's memory beyond what the server has seen.
  static int64_t Unexplained(const Connection& connection);
  // Returns a reason to shut down the connection whose waiting bytes these are, or "".
  static absl::string_view FloodOf(absl::string_view bytes, Connection* connection);
  // Shuts down a connection that is still open.
  static bool ShutDownOne(int fd, Connection* connection);

  const ConnectionLimits limits_;
  SteadyTime removed_ = SteadyTime::InfinitePast();
  Connections connections_;
  absl::flat_hash_map<std::string, int> num_of_host_;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_OPEN_CONNECTIONS_H_
