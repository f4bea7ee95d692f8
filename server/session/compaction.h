// How much of its past a map keeps.
#ifndef HYPERMAP_SERVER_SESSION_COMPACTION_H_
#define HYPERMAP_SERVER_SESSION_COMPACTION_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/snapshot.h"
#include "server/session/history_pool.h"
#include "storage/map_store.h"

namespace hypermap::server {

// A revision is kept while both rules keep it; the newest always is.
struct Retention {
  // So many revisions before the newest can be asked for.
  int64_t history_revisions = 1'000'000;
  // What the map was can be asked for so far back.
  absl::Duration history_age = absl::Hours(720);
  // For so long a request that is sent again gets the answer it got.
  absl::Duration receipt_age = absl::Hours(24);
};

// Forgets, in passes of small steps, what a map need not keep. Used by the map's writer, between
// its groups.
class Compaction {
 public:
  // All outlive this. `map` is what logs call it.
  Compaction(std::string map, storage::StoredMap* stored, HistoryPool* history,
             const Retention& retention);

  // Whether there is something to do now, at the revision `newest`.
  bool IsDue(Revision newest, absl::Time now) const;
  // When there will be, without another commit.
  absl::Time next() const;

  // Takes a few milliseconds. A pass that fails is logged, and begun again later.
  void Step(Revision newest, absl::Time now);

 private:
  absl::StatusOr<Revision> OldestToKeep(Revision newest, absl::Time now) const;
  absl::StatusOr<bool> StepOfPass(Revision newest, absl::Time now);

  const std::string map_;
  storage::StoredMap* const stored_;
  HistoryPool* const history_;
  const Retention retention_;

  bool under_way_ = false;
  absl::Time next_pass_ = absl::InfinitePast();
  Revision revision_of_last_pass_ = 0;
  Revision oldest_ = 0;         // of the pass under way
  absl::Time receipts_before_;  // likewise
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_COMPACTION_H_
