#include "base/admission/explained_bytes.h"

#include <utility>

#include "absl/hash/hash.h"
#include "base/admission/client_host.h"

namespace hypermap::admission {

void ExplainedBytes::Add(absl::string_view peer, const Explained& explained) {
  Shard& shard = shards_[absl::HashOf(peer) % kShards];
  const MutexLock lock(&shard.mutex);
  Explained& sum = shard.peers[peer];
  sum.bytes += explained.bytes;
  sum.calls += explained.calls;
}

absl::flat_hash_map<std::string, Explained> ExplainedBytes::Take() {
  absl::flat_hash_map<std::string, Explained> taken;
  for (Shard& shard : shards_) {
    Peers peers;
    {
      const MutexLock lock(&shard.mutex);
      std::swap(peers, shard.peers);
    }
    for (const auto& [peer, explained] : peers) {
      Explained& sum = taken[NormalizedPeer(peer)];
      sum.bytes += explained.bytes;
      sum.calls += explained.calls;
    }
  }
  return taken;
}

}  // namespace hypermap::admission
