// Filters the commits of a map for a subscriber.
#ifndef HYPERMAP_MAP_WATCH_FOLLOWER_H_
#define HYPERMAP_MAP_WATCH_FOLLOWER_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/edits/change.h"
#include "map/snapshot.h"
#include "map/structure.h"
#include "map/watch/map_change.h"
#include "map/watch/watch_filter.h"

namespace hypermap {

class AreaInFrames;
class PreparedFilter;

// Reads everything that a filter selects in a snapshot or a commit, in parts, so that no part is
// large and other calls get their turn. Keeps the snapshot or the commit alive. Not thread-safe;
// may move between threads.
class SelectionReader {
 public:
  virtual ~SelectionReader() = default;
  // Returns the next part, with about `max_items` objects and runs at most. Returns nothing, before
  // done(), if that takes more than about a millisecond; the next call goes on with the part, so
  // that the parts do not depend on the time. Only a comparison that can't be divided takes longer:
  // of a row of cells or an object with an area of many vertices. Breaks off if IsCancelled(); then
  // the reader and what it has returned must not be used any more. The kinds of changes depend on
  // WatchFilter::Frames.
  virtual std::vector<MapChange> Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// Filters the commits of a map, one after the other:
//
//   auto follower = Follower::Make({.layers = {"objects"}}, StructureOf(*snapshot));
//   auto selection = follower->Read(snapshot);
//   while (!selection->done()) Send(selection->Next(1000));
//   for (const Commit& commit : commits_after_snapshot) {
//     auto parts = follower->ReadCommit(commit.changes, commit.structure);
//     if (!parts) break;  // Read a newer snapshot.
//     while (!parts->done()) Send(parts->Next(1000));
//   }
//
// Its position is a structure of the map, because the meaning of a filter (where its area is in a
// layer, which labels its classes stand for) depends on it. Keeps nothing for each layer: it looks
// up a layer when a commit changes it. Not thread-safe; may move between threads. The readers that
// it has made are used on the same thread.
class Follower {
 public:
  // Bytes of memory that a follower with this filter takes at most, whatever the number of layers:
  // an estimate.
  static int64_t MaxBytes(const WatchFilter& filter);

  // NOT_FOUND for a frame that the map does not know; INVALID_ARGUMENT for an empty class.
  static absl::StatusOr<Follower> Make(WatchFilter filter, StructurePtr structure);

  Follower(Follower&&) noexcept;
  Follower& operator=(Follower&&) noexcept;
  ~Follower();

  // Reads the changes of a commit that the filter selects; they must be read before the next call.
  // `structure` is the one after the commit; the one of the call before (at first that of Make)
  // must be the one before it. Null for a reset: changes cannot bring the subscriber up to date,
  // because the place of content in its frame or the meaning of a class has changed. Then call Read
  // with a snapshot of that revision or a later one and go on after it.
  std::unique_ptr<SelectionReader> ReadCommit(std::shared_ptr<const std::vector<Change>> changes,
                                              StructurePtr structure);

  // Bytes of memory of a commit, with the content before and after it, which a reader of its parts
  // may be the last to hold: an estimate.
  static int64_t BytesOf(const std::vector<Change>& changes);

  // Reads everything that the filter selects in `snapshot`, and goes on from `structure`, which is
  // the snapshot's.
  std::unique_ptr<SelectionReader> Read(SnapshotPtr snapshot, StructurePtr structure);
  std::unique_ptr<SelectionReader> Read(const SnapshotPtr& snapshot) {
    return Read(snapshot, StructureOf(*snapshot));
  }

  // The area in the frames of layers; null if the filter has none.
  const AreaInFrames* area() const;

 private:
  class ChangeSelector;
  class CommitReader;

  Follower(std::unique_ptr<PreparedFilter> filter, StructurePtr structure);

  // Goes on from `structure`. Returns whether a reset is needed.
  bool MoveTo(const StructurePtr& structure);
  // Returns whether the change of structure moves content in the caller's frame, or changes the
  // meaning of a class, for a layer that is in both structures. Linear in the layers only if a
  // transform has changed.
  bool NeedsReset(const MapStructure& before, const MapStructure& after) const;
  bool HasMoved(const MapStructure& before, const MapStructure& after) const;

  std::shared_ptr<PreparedFilter> filter_;  // Shared with the readers.
  StructurePtr structure_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_FOLLOWER_H_
