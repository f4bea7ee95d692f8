// Compaction of a map's history and of its evidence.
#ifndef HYPERMAP_SERVER_SESSION_COMPACTION_H_
#define HYPERMAP_SERVER_SESSION_COMPACTION_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/limits/limits.h"
#include "map/snapshot.h"
#include "server/fusion/map_fusion.h"
#include "server/session/history_pool.h"
#include "server/session/map_time.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Removes old history, receipts and evidence in passes of small steps, so that no edit waits long.
// Used by the map's writer between two groups. Not thread safe.
class Compaction {
 public:
  // A revision is kept while both limits.history_revisions and limits.history_age keep it; the
  // newest is always kept. Evidence is kept for limits.observation_age. Ages are time that passed
  // by `time`, not by the wall clock. The pointers must outlive this. `map` is the name in log
  // lines.
  Compaction(std::string map, storage::StoredMap* stored, HistoryPool* history, const MapTime* time,
             const Limits& limits);

  // Returns whether a step is due. `newest` is the map's newest revision.
  bool IsDue(Revision newest) const;
  // The value of MapTime::Passed at which a step is due even if no commit comes before.
  absl::Duration next() const;

  // Begins a pass, or continues the current one; takes a few milliseconds. A pass that fails is
  // logged, and begun again later. `fusion` is the map's.
  void Step(Revision newest, MapFusion* fusion);

 private:
  // The oldest revision that the limits keep.
  absl::StatusOr<Revision> OldestToKeep(Revision newest) const;
  // Returns whether the pass has more to do.
  absl::StatusOr<bool> StepOfPass(Revision newest, MapFusion* fusion);
  absl::Status ForgetEvidence(MapFusion* fusion);

  const std::string map_;
  storage::StoredMap* const stored_;
  HistoryPool* const history_;
  const MapTime* const time_;
  const Limits limits_;

  bool under_way_ = false;
  absl::Duration next_pass_ = -absl::InfiniteDuration();
  Revision revision_of_last_pass_ = 0;
  // Arguments of the pass under way, fixed at its beginning so that the pass comes to an end.
  Revision oldest_ = 0;
  absl::Time receipts_before_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_COMPACTION_H_
