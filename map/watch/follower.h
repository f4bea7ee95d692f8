// What somebody who follows a part of a map is told of each commit.
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
#include "map/watch/told_change.h"

namespace hypermap {

// What is followed: the defaults are all layers, the map's own frame, everywhere, all classes.
struct WatchFilter {
  std::vector<std::string> layers;  // need not be there yet
  std::string frame_id;
  std::optional<Polygon> area;       // in that frame
  std::vector<std::string> classes;  // labels, or aliases of them
  // For replicas: all is told in the frame of its layer, also of layers that are not connected to
  // `frame_id` (of which an area selects nothing); the area selects the cells that touch it; and a
  // selection tells transforms and layers as well.
  bool as_stored = false;
};

// All that a filter selects in a snapshot, in parts. Keeps the snapshot alive. Not thread safe; may
// be handed from thread to thread.
class SelectionReader {
 public:
  virtual ~SelectionReader() = default;
  // kPut and kCells changes with at most about `max_items` objects and runs; may be none. As
  // stored: first kTransform of all frames, and kLayerCreated of each layer before its content.
  virtual std::vector<ToldChange> Next(int max_items) = 0;
  virtual bool done() const = 0;
};

// Follows a map from one structure (map/watch/structure.h) to the next. Not thread safe; may be
// handed from thread to thread.
class Follower {
 public:
  // NOT_FOUND for a frame that the map does not know; INVALID_ARGUMENT for an empty class.
  static absl::StatusOr<Follower> Make(WatchFilter filter, SnapshotPtr structure);

  Follower(Follower&&) noexcept;
  Follower& operator=(Follower&&) noexcept;
  ~Follower();

  // What a commit tells; `structure` is that after it, the last one given is that before it. With
  // `reset` what was told before does not hold any more and nothing is told of the commit: the
  // place of something in the caller's frame, or the meaning of a class, has changed. Then Read a
  // snapshot of that revision or a later one and go on after it.
  struct Told {
    bool reset = false;
    std::vector<ToldChange> changes;
  };
  Told Tell(const std::vector<Change>& changes, const SnapshotPtr& structure);

  // All that the filter selects in `snapshot`, from whose structure it then goes on.
  std::unique_ptr<SelectionReader> Read(SnapshotPtr snapshot);

 private:
  class FollowedLayer;
  class Teller;
  class StoredReader;

  Follower(WatchFilter filter, std::string frame_id, std::set<std::string> classes);

  bool Follows(const std::string& layer) const;
  void MoveTo(const SnapshotPtr& structure);
  // Whether the layers of both structures can be told of alike.
  bool NeedsReset(const Snapshot& before, const Snapshot& after) const;

  WatchFilter filter_;
  std::string frame_id_;
  std::set<std::string> classes_;  // folded
  SnapshotPtr structure_;
  std::map<std::string, std::shared_ptr<const FollowedLayer>> layers_;  // of structure_
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_FOLLOWER_H_
