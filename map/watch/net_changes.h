// The difference of two revisions of a map.
#ifndef HYPERMAP_MAP_WATCH_NET_CHANGES_H_
#define HYPERMAP_MAP_WATCH_NET_CHANGES_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/edits/change.h"
#include "map/frames/frame_tree.h"
#include "map/grid/cell_domain.h"
#include "map/structure.h"
#include "map/watch/map_change.h"

namespace hypermap {

// Combines the commits between two revisions into their difference. Each object and cell appears
// once, with its state before the first commit and after the last, and not at all if these are
// equal. Uses memory for everything that the commits touched:
//
//   NetChanges net;
//   for (const Commit& commit : commits_between) net.Add(commit.changes);
//   NetChanges::Reader difference = std::move(net).Read(from, to, {}, "map");
//   while (!difference.done()) {
//     HYPERMAP_ASSIGN_OR_RETURN(std::optional<MapChange> change, difference.Next());
//     if (change) Send(*change);
//   }
class NetChanges {
 public:
  class Reader;

  // Must be called for each commit in order.
  void Add(const std::vector<Change>& changes);

  // Returns a reader of the difference. `from` and `to` are the structures of the two revisions.
  // Only the named layers are compared (all if `layers` is empty), and content only of those
  // connected to `frame_id` at `to`. The order: transforms, then the layers by name; in a layer,
  // the change of the layer itself, objects by id, cells by tile.
  Reader Read(StructurePtr from, StructurePtr to, const std::vector<std::string>& layers,
              std::string frame_id) &&;

 private:
  struct Ends {
    ObjectPtr before;
    ObjectPtr after;
  };
  struct TileEnds {
    TilePtr before;
    TilePtr after;
  };
  struct LayerChanges {
    bool deleted = false;  // Whether the layer of revision `from` was deleted.
    bool created = false;  // Whether the layer of revision `to` was created.
    std::map<ObjectId, Ends> objects;
    std::map<TileIndex, TileEnds> tiles;
  };
  class Adder;

  std::map<std::string, LayerChanges> layers_;
};

// Reads a difference change by change, because all changes together may take far more memory than
// the tiles that they come from. Drops each object and tile when it was read. Not thread-safe; may
// move between threads.
class NetChanges::Reader {
 public:
  // Returns the next change, or nullopt if the object, the tile or the layer that was compared is
  // as it was. A change has the cells of at most one tile. Errors of CheckCancelled. REQUIRES:
  // !done().
  absl::StatusOr<std::optional<MapChange>> Next();
  bool done() const { return next_transform_ == transforms_.size() && layers_.empty(); }
  // The work so far: each call of Next counts as 1, and one that compares a tile as its rows.
  int64_t looks() const { return looks_; }

 private:
  friend class NetChanges;

  Reader(StructurePtr from, StructurePtr to, std::string frame_id,
         std::map<std::string, LayerChanges> layers);

  // Returns a change of the current layer.
  MapChange Make(ChangeKind kind) const;
  std::optional<MapChange> BeginLayer();
  // These remove what they compare from the current layer.
  std::optional<MapChange> CompareObject();
  std::optional<MapChange> CompareTile();

  StructurePtr from_;
  StructurePtr to_;
  std::string frame_id_;
  std::vector<FrameTransform> transforms_;  // That differ.
  size_t next_transform_ = 0;
  // The layers that are left; the first is the current one.
  std::map<std::string, LayerChanges> layers_;
  // The current layer, once it was begun.
  bool in_layer_ = false;
  const LayerStructure* layer_ = nullptr;  // The layer in to_; null if it is not there any more.
  std::shared_ptr<const CellDomain> domain_;
  PlanarTransform caller_from_layer_;
  int64_t looks_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_NET_CHANGES_H_
