// Compares a replica with its server.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_COMPARISON_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_COMPARISON_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "client_libs/cpp/replica/replica.h"

namespace hypermap::client {

// Asks the server now and then for digests of the map, and compares them with those of the replica
// at the same revision. Revisions that pass meanwhile are kept, so that the one of the answer is
// among them. Makes its calls on a thread of its own. Thread safe.
class Comparison {
 public:
  struct Count {
    int num_equal = 0;
    int num_different = 0;
    std::string last_difference;  // "revision 7: layer things"; empty if there was none
  };

  // The first comparison begins after options.compare_every. `differs` is called on the thread of
  // the comparison when the replica has to be fetched again.
  Comparison(Client client, const ReplicaOptions& options, std::function<void()> differs);
  ~Comparison() { Stop(); }
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;

  // Ends the thread, and waits for a call under way.
  void Stop();
  // Notes a revision that the replica has from now on.
  void Note(const KnownRevision& revision);
  Count count() const;

 private:
  void Run();
  // Waits for the next round; false if the comparison ends.
  bool AwaitRound();
  // Asks once. Returns false if the replica never had what the answer is about, as it changes
  // faster than it is sent; errors of Client::DigestMap.
  absl::StatusOr<bool> Compare();
  // The replica as it was when it had what the answer is about, once it has; null if it skips that.
  SnapshotPtr Await(const DigestAnswer& answer);
  // Whether the replica was then at the answer's revision, or at others between which none of its
  // layers changed.
  bool IsComparable(const KnownRevision& replica, const DigestAnswer& answer) const;
  // The layers that differ and are mirrored, and perhaps "frames".
  std::vector<std::string> Differing(const Snapshot& replica, const DigestAnswer& answer) const;
  bool IsMirrored(const std::string& layer) const;

  Client client_;
  const ReplicaOptions options_;
  const std::function<void()> differs_;

  mutable Mutex mutex_;
  CondVar changed_;
  // Those that the replica has had since the question, the newest last; only the newest if no
  // question is under way.
  std::vector<KnownRevision> passed_ ABSL_GUARDED_BY(mutex_);
  bool is_asking_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_ending_ ABSL_GUARDED_BY(mutex_) = false;
  Count count_ ABSL_GUARDED_BY(mutex_);

  std::thread thread_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_COMPARISON_H_
