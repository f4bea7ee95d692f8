// Accepts the connections of a server within limits.
#ifndef HYPERMAP_BASE_ADMISSION_CONNECTION_LISTENER_H_
#define HYPERMAP_BASE_ADMISSION_CONNECTION_LISTENER_H_

#include <sys/socket.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/admission/explained_bytes.h"
#include "base/admission/handover.h"
#include "base/admission/listening_socket.h"
#include "base/admission/open_connections.h"
#include "base/admission/pace.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

struct ConnectionListenerOptions {
  // HOST:PORT; port 0 takes a free port.
  std::string address;
  ConnectionLimits limits;
  // Limit of the resident memory of the process, in bytes; 0: none. From 15/16 of it on, the
  // connections are shut down of which gRPC holds the most bytes that the server has not seen
  // (ExplainedBytes); from half of it on, those that hold such bytes and send nothing more; from a
  // quarter of it on, those with many streams of which the server knows no call.
  int64_t max_resident_bytes = 0;
  // Returns the bytes of memory that the server keeps whatever connections do, such as its content:
  // they are left out of the memory above, of which the others then may take at least half. Called
  // by the listener's thread every 20 ms.
  std::function<int64_t()> kept_bytes = [] { return int64_t{0}; };
  // A connection with more such bytes is shut down whatever memory is in use, since no client has
  // so many unfinished messages under way. 0: no bound. In bytes.
  int64_t max_unexplained_bytes = 0;
  // Returns what the server has seen of each connection since the last call; empty if the server
  // does not tell: then the connections that receive the most are shut down. Called by the
  // listener's thread several times in a second.
  std::function<absl::flat_hash_map<std::string, Explained>()> take_explained;
  // Returns the number of open streams of each connection (NormalizedPeer); empty if the server
  // does not tell. Called by the listener's thread up to 25 times in a second, while more than an
  // eighth of `max_resident_bytes` is in use.
  std::function<absl::flat_hash_map<std::string, int64_t>()> open_streams;
  // Takes a connected, non-blocking socket, which it must close. Called by threads of the listener
  // (Handover).
  std::function<void(FileDescriptor socket)> accept;
  // Returns the peers (NormalizedPeer) whose connections are to be shut down, because they flood
  // the server with cancelled calls. Called by the listener's thread every 20 ms.
  std::function<std::vector<std::string>()> floods = [] { return std::vector<std::string>(); };
  // Takes lines for the log, at most one of a kind in 10 s. Called by the listener's thread.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
};

// Has one thread that accepts connections, and shuts down those that flood the server (see
// OpenConnections::ShutDownFloods). A connection beyond the limits, or for which the process has no
// descriptor left, is closed at once; as soon as others have been closed, new ones are accepted
// again.
//
// New connections of a host wait, in their order,
// - beyond a pace of 200 in a second, after a burst of 1000: a client that connects, sends nonsense
//   and connects again costs gRPC more than itself;
// - for a minute after a flood of cancelled calls, or of calls without a message: 0.1 to 0.8 s, the
//   longer the more floods there were, and then beyond a pace of 20 in a second. Those that have
//   sent a flood meanwhile are closed;
// - for 0.5 ms for each call without a message that was open when its connection was shut down, up
//   to 10 s: each takes time of gRPC. For a minute, connections of the host with 100 such calls are
//   shut down whatever the memory.
// A connection that its client closes while it waits is dropped.
class ConnectionListener {
 public:
  // The errors of Listen; RESOURCE_EXHAUSTED if no thread can be started.
  static absl::StatusOr<std::unique_ptr<ConnectionListener>> Start(
      ConnectionListenerOptions options);
  // Stops.
  ~ConnectionListener();
  ConnectionListener(const ConnectionListener&) = delete;
  ConnectionListener& operator=(const ConnectionListener&) = delete;

  // HOST:PORT with the actual port.
  const std::string& address() const { return address_; }
  // Accepts no more connections. Accepted ones stay open.
  void Stop();
  // Shuts down the connections that were accepted and are still open. REQUIRES: Stop was called.
  void ShutDownConnections() { connections_.ShutDownAll(); }

  // Connections that are open, and that were refused or shut down since the start.
  int num_open() const { return num_open_; }
  int64_t num_refused() const { return num_refused_; }
  int64_t num_shut_down() const { return num_shut_down_; }

 private:
  ConnectionListener(ConnectionListenerOptions options, ListeningSockets listening,
                     FileDescriptor wake);

  void Run();
  // For how long to wait for new connections, as poll takes it.
  int TimeToNextLook_ms() const;
  // Looks after the connections that are open.
  void Look();
  // Accepts the connections that wait, up to a number.
  void AcceptSome(int listener);
  // Accepts and closes a connection when there is no descriptor for it. Returns false if not even
  // that works.
  bool RefuseWithSpare(int listener);
  void Refuse(const std::string& reason);
  // Gives the connection to `accept`, at once or after a while.
  void AcceptOrHold(FileDescriptor socket, const std::string& host);
  // Accepts or closes the connections that have waited long enough.
  void ReleaseHeld();
  void GuardFloods();
  void AccountBytes();
  // `resident` and `most` as in GuardMemory.
  void GuardStreams(int64_t resident, int64_t most);
  void GuardMemory();
  // Returns freed memory to the system now and then while `resident` is well above what it once
  // was.
  void ReturnAfterPeak(int64_t resident);
  // Bytes that connections can't have freed.
  int64_t KeptBytes();
  // Returns freed memory to the system if that is due.
  void ReturnMemory();
  // Counts and logs connections that were shut down, with more words about the reason.
  void ReportShutDown(const std::vector<ShutDownPeer>& peers, absl::string_view more = "");

  // A new connection that waits.
  struct Held {
    FileDescriptor socket;
    std::string host;
    // Earliest time at which it is accepted.
    SteadyTime until;
  };
  struct Suspect {
    int num_floods = 0;
    SteadyTime last_flood = SteadyTime::InfinitePast();
    // Until then new connections wait for the calls without a message of earlier ones.
    SteadyTime streams_until = SteadyTime::InfinitePast();
  };
  Suspect& Suspected(const std::string& host);
  // For how long new connections of the host wait, because it has flooded the server.
  absl::Duration WaitAfterFloods(const std::string& host);

  const ConnectionListenerOptions options_;
  const std::string address_;
  // Used by the thread only.
  std::vector<FileDescriptor> listeners_;
  OpenConnections connections_;
  std::deque<Held> held_;
  // From Start to Stop.
  std::unique_ptr<Handover> handover_;
  absl::flat_hash_map<std::string, Suspect> suspects_;
  Pace pace_;
  Pace pace_of_suspects_;
  // Kept open to be closed when a descriptor is needed to refuse a connection.
  FileDescriptor spare_;
  SteadyTime looked_ = SteadyTime::InfinitePast();
  SteadyTime refusal_logged_ = SteadyTime::InfinitePast();
  // By the reason.
  absl::flat_hash_map<absl::string_view, SteadyTime> shutdown_logged_;
  SteadyTime accounted_ = SteadyTime::InfinitePast();
  SteadyTime streams_due_ = SteadyTime::InfinitePast();
  SteadyTime stalled_shut_down_ = SteadyTime::InfinitePast();
  SteadyTime largest_shut_down_ = SteadyTime::InfinitePast();
  SteadyTime streams_shut_down_ = SteadyTime::InfinitePast();
  // True if bytes are counted in each period, because memory is about to be short.
  bool is_memory_short_ = false;
  SteadyTime memory_returned_ = SteadyTime::InfinitePast();
  int64_t least_resident_ = std::numeric_limits<int64_t>::max();  // so far
  bool has_peak_ = false;
  SteadyTime peak_returned_ = SteadyTime::InfinitePast();
  absl::Duration peak_period_;
  int64_t most_kept_ = 0;  // Since memory was returned after a fall.
  SteadyTime kept_fell_ = SteadyTime::InfiniteFuture();

  const FileDescriptor wake_;
  std::atomic<bool> stopping_ = false;
  std::atomic<int> num_open_ = 0;
  std::atomic<int64_t> num_refused_ = 0;
  std::atomic<int64_t> num_shut_down_ = 0;
  std::thread thread_;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_CONNECTION_LISTENER_H_
