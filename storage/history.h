// What a map was: read beside its writer, without making it wait.
#ifndef HYPERMAP_STORAGE_HISTORY_H_
#define HYPERMAP_STORAGE_HISTORY_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/edits/change.h"
#include "map/layers/grid/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::storage {

struct RevisionRecord {
  Revision revision = 0;
  absl::Time time;
  std::string author;
  int64_t num_changes = 0;
};

// A commit as it was written: Commit::applied.changes in their order, with what was before and
// after.
struct PastCommit {
  RevisionRecord record;
  std::vector<Change> changes;
};

// The revisions that can be asked for, and those whose commits are kept: oldest < revision <=
// newest.
struct KeptRevisions {
  Revision oldest = 0;
  Revision newest = 0;
};

// A map at one kept revision; reads only what it is asked for. Nothing that is written or forgotten
// meanwhile shows.
class PastMap {
 public:
  virtual ~PastMap() = default;

  // The snapshot of that revision without content: frames, ids, versions, and layers that are empty
  // but have their spec, and grids their extent.
  virtual const SnapshotPtr& structure() const = 0;

  // Those objects of a semantic layer whose box shares a point with `box` (layer frame), by id; may
  // hold others near it.
  virtual absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer,
                                                         const Box& box) = 0;
  // All of them, by id.
  virtual absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer) = 0;

  // The tiles of a grid that share a cell with `cells`.
  virtual absl::StatusOr<TileMap> Tiles(const std::string& layer, const CellBox& cells) = 0;
};

// One thread at a time. Errors: UNAVAILABLE, or DATA_LOSS naming what is damaged.
class HistoryReader {
 public:
  virtual ~HistoryReader() = default;

  virtual absl::StatusOr<KeptRevisions> Kept() = 0;

  // The newest revision that was made at `time` or before (the map's creation counts as revision
  // 0). OUT_OF_RANGE naming the time of the oldest kept when that is later.
  virtual absl::StatusOr<Revision> RevisionAt(absl::Time time) = 0;

  // OUT_OF_RANGE naming the oldest kept revision, or the newest. The reader must outlive the
  // answer, and there is one at a time.
  virtual absl::StatusOr<std::unique_ptr<PastMap>> At(Revision revision) = 0;

  // The commits after `after`, in order, as many whole ones as have together at most `max_changes`
  // changes, but at least one; none when `after` is the newest. OUT_OF_RANGE as At when `after` is
  // not kept.
  virtual absl::StatusOr<std::vector<PastCommit>> Commits(Revision after, int max_changes) = 0;

  // Revisions after `after` and before `before`, in order, at most `max_count`; with `newest_first`
  // the newest of them, in reverse.
  virtual absl::StatusOr<std::vector<RevisionRecord>> Revisions(Revision after, Revision before,
                                                                bool newest_first,
                                                                int max_count) = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_HISTORY_H_
