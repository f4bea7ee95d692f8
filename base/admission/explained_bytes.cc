#include "base/admission/explained_bytes.h"

#include <utility>

#include "absl/hash/hash.h"
#include "base/admission/client_host.h"

namespace hypermap::admission {

ExplainedBytes::Connection::Connection(absl::string_view peer) : host(HostOfPeer(peer)) {}

ExplainedBytes::Call::Call(ExplainedBytes* all, absl::string_view peer)
    : connection_(all->Find(peer)) {
  connection_->bytes += kHeaderBytes;
  ++connection_->calls;
}

ExplainedBytes::Call::~Call() { --connection_->calls; }

void ExplainedBytes::Call::Explain(int64_t bytes) { connection_->bytes += bytes; }

const std::string& ExplainedBytes::Call::host() const { return connection_->host; }

std::shared_ptr<ExplainedBytes::Connection> ExplainedBytes::Find(absl::string_view peer) {
  Shard& shard = shards_[absl::HashOf(peer) % kShards];
  const MutexLock lock(&shard.mutex);
  std::shared_ptr<Connection>& connection = shard.connections[peer];
  if (connection == nullptr) connection = std::make_shared<Connection>(peer);
  return connection;
}

absl::flat_hash_map<std::string, Explained> ExplainedBytes::Take() {
  absl::flat_hash_map<std::string, Explained> taken;
  for (Shard& shard : shards_) {
    const MutexLock lock(&shard.mutex);
    for (auto it = shard.connections.begin(); it != shard.connections.end();) {
      const auto here = it++;
      Connection& connection = *here->second;
      // Looked at first: without calls, the counts change no more.
      const bool has_calls = here->second.use_count() > 1;
      std::atomic_thread_fence(std::memory_order_acquire);
      const Explained explained{connection.bytes.exchange(0), connection.calls.exchange(0)};
      if (explained.bytes != 0 || explained.calls != 0) {
        Explained& sum = taken[NormalizedPeer(here->first)];
        sum.bytes += explained.bytes;
        sum.calls += explained.calls;
      }
      if (!has_calls) shard.connections.erase(here);
    }
  }
  return taken;
}

}  // namespace hypermap::admission
