// How many of the bytes that a connection received the server has seen as calls and messages.
#ifndef HYPERMAP_BASE_ADMISSION_EXPLAINED_BYTES_H_
#define HYPERMAP_BASE_ADMISSION_EXPLAINED_BYTES_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"

namespace hypermap::admission {

// The bytes and calls of one connection that were explained since the last call of Take.
struct Explained {
  int64_t bytes = 0;
  // Calls that began, less those that ended.
  int64_t calls = 0;
};

// Collects the bytes of requests that the server was given, for each connection. The rest of what a
// connection received is held by gRPC, and no budget counts it: messages that have come in part,
// blocks of headers without an end, and streams without a message. Thread safe. REQUIRES: Take is
// called now and then, because it forgets the connections.
class ExplainedBytes {
  struct Connection;

 public:
  // The headers of a call. Repeated fields take few bytes of a connection.
  static constexpr int64_t kHeaderBytes = 1'024;

  // A call from its begin to its end. The connection is looked up once, because this is made for
  // every call.
  class Call {
   public:
    // `peer` as gRPC writes it ("ipv4:127.0.0.1:4711").
    Call(ExplainedBytes* all, absl::string_view peer);
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    // The server was given a message of this size, whether it accepts it or not. Thread safe.
    void Explain(int64_t bytes);
    // The host of the peer (HostOfPeer).
    const std::string& host() const;

   private:
    const std::shared_ptr<Connection> connection_;
  };

  // Returns what was explained since the last call, by peer (NormalizedPeer), and forgets it.
  absl::flat_hash_map<std::string, Explained> Take();

 private:
  struct Connection {
    explicit Connection(absl::string_view peer);

    const std::string host;
    std::atomic<int64_t> bytes = 0;
    std::atomic<int64_t> calls = 0;
  };
  using Connections = absl::flat_hash_map<std::string, std::shared_ptr<Connection>>;
  struct Shard {
    Mutex mutex;
    Connections connections ABSL_GUARDED_BY(mutex);
  };

  std::shared_ptr<Connection> Find(absl::string_view peer);

  static constexpr size_t kShards = 16;
  std::array<Shard, kShards> shards_;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_EXPLAINED_BYTES_H_
