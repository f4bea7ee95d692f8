// Filters the commits of a map for a subscriber.
#ifndef HYPERMAP_MAP_WATCH_FOLLOWER_H_
#define HYPERMAP_MAP_WATCH_FOLLOWER_H_

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/edits/change.h"
#include "map/geometry/polygon.h"
#include "map/watch/map_change.h"

namespace hypermap {

// The part of a map that is watched. By default all layers, in the map's own frame, everywhere,
// with all classes.
struct WatchFilter {
  // The frames in which content is reported, and what else depends on them.
  enum class Frames {
    // Content is converted to `frame_id`. Layers that are not connected to that frame are left out.
    // An area selects the cells with their centre in it. A selection contains kPut and kCells.
    kCaller,
    // For replicas: content stays in the frame of its layer. Layers that are not connected to
    // `frame_id` are included, but an area selects nothing of them. An area selects the cells that
    // touch it. A selection begins with kTransform for all transforms, and has kLayerCreated for
    // each layer before its content.
    kAsStored,
  };

  std::vector<std::string> layers;  // Need not exist yet.
  std::string frame_id;
  std::optional<Polygon> area;       // In the frame `frame_id`.
  std::vector<std::string> classes;  // Labels, or aliases of labels.
  Frames frames = Frames::kCaller;

  friend bool operator==(const WatchFilter&, const WatchFilter&) = default;
};

// Reads everything that a filter selects in a snapshot, in parts, so that no part is large and
// other calls get their turn. Keeps the snapshot alive. Not thread-safe; may move between threads.
class SelectionReader {
 public:
  virtual ~SelectionReader() = default;
  // Returns the next changes, with about `max_items` objects and runs at most; may be empty before
  // done(). The kinds of changes depend on WatchFilter::Frames.
  virtual std::vector<MapChange> Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// Filters the commits of a map, one after the other:
//
//   auto follower = Follower::Make({.layers = {"objects"}}, StructureOf(*snapshot));
//   auto selection = follower->Read(snapshot);
//   while (!selection->done()) Send(selection->Next(1000));
//   for (const Commit& commit : commits_after_snapshot) {
//     Follower::Told told = follower->Tell(commit.changes, commit.structure);
//     if (!told.reset) Send(told.changes);  // Otherwise read a newer snapshot.
//   }
//
// Its position is a structure of the map, because the meaning of a filter (where its area is in a
// layer, which labels its classes stand for) depends on it. Not thread-safe; may move between
// threads.
class Follower {
 public:
  // NOT_FOUND for a frame that the map does not know; INVALID_ARGUMENT for an empty class.
  static absl::StatusOr<Follower> Make(WatchFilter filter, StructurePtr structure);

  Follower(Follower&&) noexcept;
  Follower& operator=(Follower&&) noexcept;
  ~Follower();

  // The part of a commit that the filter selects. With `reset`, changes cannot bring the subscriber
  // up to date, because the place of content in its frame or the meaning of a class has changed.
  // Then `changes` is empty; call Read with a snapshot of that revision or a later one and go on
  // after it.
  struct Told {
    bool reset = false;
    std::vector<MapChange> changes;
  };
  // Filters the changes of a commit. `structure` is the one after the commit; the one of the call
  // before (at first that of Make) must be the one before it.
  Told Tell(const std::vector<Change>& changes, const StructurePtr& structure);

  // Reads everything that the filter selects in `snapshot`, and goes on from its structure.
  std::unique_ptr<SelectionReader> Read(SnapshotPtr snapshot);

 private:
  class FollowedLayer;
  class ChangeSelector;
  class StoredReader;

  Follower(WatchFilter filter, std::string frame_id, std::set<std::string> classes);

  bool as_stored() const { return filter_.frames == WatchFilter::Frames::kAsStored; }
  bool Follows(const std::string& layer) const;
  void MoveTo(const StructurePtr& structure);
  // Whether the change of structure moves content in the caller's frame, or changes the meaning of
  // a class, for a layer that is in both structures.
  bool NeedsReset(const MapStructure& before, const MapStructure& after) const;

  WatchFilter filter_;
  std::string frame_id_;
  std::set<std::string> classes_;  // Folded.
  StructurePtr structure_;
  std::map<std::string, std::shared_ptr<const FollowedLayer>> layers_;  // Layers of structure_.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_FOLLOWER_H_
