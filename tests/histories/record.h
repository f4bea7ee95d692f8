// What has happened in a history, and the promises that it must keep.
#ifndef HYPERMAP_TESTS_HISTORIES_RECORD_H_
#define HYPERMAP_TESTS_HISTORIES_RECORD_H_

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "client_libs/cpp/watch.h"
#include "map/snapshot.h"
#include "server/fusion/testing/memory_fusion_log.h"
#include "server/session/map_session.h"
#include "storage/map_store.h"

namespace hypermap::histories {

// The label of what all observations see, besides one that tells them apart.
inline constexpr char kSeenThing[] = "chair";

// All revisions that ever were on the server's disk. The first broken promise ends a history.
class Record {
 public:
  // `fusion` are the server's options of fusion.
  explicit Record(server::FusionOptions fusion) : fusion_(std::move(fusion)) {}

  // The first broken promise; empty if there is none.
  const std::string& violation() const { return violation_; }
  void Violate(absl::string_view what);

  // Commits are on disk. Promises: one history without gaps; each request and each observation is
  // carried out once; a fused layer is the fold of its log.
  void Committed(absl::Span<const storage::Commit> commits);
  // The process was killed while it wrote these commits, or their write failed: unless others are
  // written before, the next start shows whether they are on disk, all or none of them.
  void MayBeCommitted(absl::Span<const storage::Commit> commits);
  // The state of a running server. Promise: what is visible is on disk, and the other way round.
  void CheckServer(const server::MapSession& session);
  // The server was started. Promise: it has all that was ever on disk, and the map is the same
  // incarnation.
  void CheckStarted(const server::MapSession& session);
  // The server has answered a request with this revision. Promise: the revision contains it.
  void Acknowledged(const std::string& request_id, Revision revision);
  // The server has acknowledged an observation. Promise: it is in the log.
  void ObservationAcknowledged(const std::string& robot, int64_t sequence);
  // A replica has applied an event. `before`: the revision that it had before; -1: none. Promises:
  // no revision is repeated or left out; the replica equals the server at its revision.
  void CheckReplica(const client::WatchEvent& event, const client::KnownRevision& after,
                    Revision before);

  Revision newest() const { return made_.empty() ? 0 : made_.rbegin()->first; }
  bool has_request(const std::string& id) const { return requests_.count(id) > 0; }
  // How often the log accepted an observation with a detection of this label.
  int64_t TimesObserved(const std::string& label) const;
  // The sequences of a robot's observations in the log.
  absl::StatusOr<std::vector<SequenceRange>> Sequences(const std::string& layer,
                                                       const std::string& robot) {
    return log_.Sequences(layer, robot);
  }

 private:
  struct Made {
    SnapshotPtr snapshot;
    absl::Time time;
    std::string request_id;
    size_t num_changes = 0;
  };

  void Commit(const storage::Commit& commit);
  void CheckFold(const Snapshot& snapshot, const std::string& layer);

  const server::FusionOptions fusion_;
  std::string violation_;
  std::map<Revision, Made> made_;
  std::vector<storage::Commit> perhaps_;  // MayBeCommitted
  uint64_t incarnation_ = 0;
  std::map<std::string, Revision> requests_;
  std::set<std::pair<std::string, int64_t>> observations_;  // robot, sequence
  std::map<std::string, int64_t> observed_;                 // by label
  server::MemoryFusionLog log_;
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_RECORD_H_
