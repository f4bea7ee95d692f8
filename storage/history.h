// The interface for reading past revisions of a map. Readers never make the writer wait.
#ifndef HYPERMAP_STORAGE_HISTORY_H_
#define HYPERMAP_STORAGE_HISTORY_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/edits/change.h"
#include "map/entries.h"
#include "map/layers/grid_layer.h"
#include "map/structure.h"

namespace hypermap::storage {

using hypermap::RevisionRecord;

// A commit as it was written: Commit::applied.changes in their order, with the content before and
// after each.
struct PastCommit {
  RevisionRecord record;
  std::vector<Change> changes;
};

// The state of revisions oldest to newest can be read, and the commits of those after the oldest.
struct KeptRevisions {
  Revision oldest = 0;
  Revision newest = 0;
};

// A map at one kept revision. Content is read on demand, and always as of that revision, whatever
// is written or compacted meanwhile.
class PastMap {
 public:
  virtual ~PastMap() = default;

  virtual const StructurePtr& structure() const = 0;

  // A part of a layer: of a semantic layer the objects of a box, of a grid the tiles of some cells.
  struct Region {
    std::string layer;
    Box box;
    CellBox cells;
  };
  // Tells which regions are read next, so that a store that is far away can find all of them at
  // once. Need not be called.
  virtual absl::Status Expect(absl::Span<const Region> regions) {
    static_cast<void>(regions);
    return absl::OkStatus();
  }

  // The objects of a semantic layer whose box shares a point with `box` (in the layer's frame), and
  // perhaps some near it, ordered by id.
  virtual absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer,
                                                         const Box& box) = 0;
  // All objects of a semantic layer, ordered by id.
  virtual absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer) = 0;

  // The tiles of a grid layer that share a cell with `cells`.
  virtual absl::StatusOr<TileMap> Tiles(const std::string& layer, const CellBox& cells) = 0;
};

// One thread at a time. Errors of all methods: UNAVAILABLE, or DATA_LOSS naming the damaged table
// and row.
class HistoryReader {
 public:
  virtual ~HistoryReader() = default;

  virtual absl::StatusOr<KeptRevisions> Kept() = 0;

  // The newest revision made at `time` or before; the map's creation is revision 0. OUT_OF_RANGE
  // naming the time of the oldest kept revision when that is later.
  virtual absl::StatusOr<Revision> RevisionAt(absl::Time time) = 0;

  // The map at a revision. OUT_OF_RANGE naming the oldest kept revision, or the newest. At most one
  // PastMap of a reader may exist at a time, and the reader must outlive it.
  virtual absl::StatusOr<std::unique_ptr<PastMap>> At(Revision revision) = 0;

  // The commits after the revision `after`, in order: as many whole commits as have at most
  // `max_changes` changes together, but at least one. None when `after` is the newest. OUT_OF_RANGE
  // when `after` is not kept.
  virtual absl::StatusOr<std::vector<PastCommit>> Commits(Revision after, int max_changes) = 0;

  // At most `max_count` of the revisions after `after` and before `before`: the oldest of them in
  // order or, with `newest_first`, the newest of them in reverse order.
  virtual absl::StatusOr<std::vector<RevisionRecord>> Revisions(Revision after, Revision before,
                                                                bool newest_first,
                                                                int max_count) = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_HISTORY_H_
