// How many of the bytes that a connection received the server has seen as calls and messages.
#ifndef HYPERMAP_BASE_ADMISSION_EXPLAINED_BYTES_H_
#define HYPERMAP_BASE_ADMISSION_EXPLAINED_BYTES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"

namespace hypermap::admission {

// What was explained of one connection since the last call of Take.
struct Explained {
  int64_t bytes = 0;
  // Calls that began, less those that ended.
  int64_t calls = 0;
};

// Collects the bytes of requests that the server was given, for each connection. The rest of what a
// connection received is held by gRPC, and no budget counts it: messages that have come in part,
// blocks of headers without an end, and streams without a message.
//
// All functions take peers as gRPC writes them ("ipv4:127.0.0.1:4711"). Thread safe; a call takes
// less than 0.1 µs. REQUIRES: Take is called now and then, because it forgets the connections.
class ExplainedBytes {
 public:
  // The headers of a call. Repeated fields take few bytes of a connection.
  static constexpr int64_t kHeaderBytes = 1'024;

  // The server has begun to handle a call. REQUIRES: EndCall is called once for each BeginCall.
  void BeginCall(absl::string_view peer) { Add(peer, {kHeaderBytes, 1}); }
  void EndCall(absl::string_view peer) { Add(peer, {0, -1}); }
  // The server was given a message of this size, whether it accepts it or not.
  void Explain(absl::string_view peer, int64_t bytes) { Add(peer, {bytes, 0}); }

  // Returns what was explained since the last call, by peer (NormalizedPeer), and forgets it.
  absl::flat_hash_map<std::string, Explained> Take();

 private:
  using Peers = absl::flat_hash_map<std::string, Explained>;
  struct Shard {
    Mutex mutex;
    Peers peers ABSL_GUARDED_BY(mutex);
  };

  void Add(absl::string_view peer, const Explained& explained);

  static constexpr size_t kShards = 16;
  std::array<Shard, kShards> shards_;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_EXPLAINED_BYTES_H_
