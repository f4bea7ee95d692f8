// Makes the next snapshot of a map, change by change.
#ifndef HYPERMAP_MAP_EDITS_SNAPSHOT_EDITOR_H_
#define HYPERMAP_MAP_EDITS_SNAPSHOT_EDITOR_H_

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/edits/change.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "map/snapshot.h"

namespace hypermap {

// Applies changes to a copy of a snapshot, and records them. Snapshots are made from earlier ones
// in no other way: Apply (map/edits/apply.h) uses it for edits that it has checked, and a replica
// for the events of its subscription.
//
// Changes of content and aliases are collected for each layer, and Finish makes the new layers;
// until then, `current` has the old ones. Layers that do not change are shared with the snapshot
// before. A method that returns an error has changed nothing, unless its comment says otherwise.
class SnapshotEditor {
 public:
  // `before` becomes a snapshot of `revision`. WriteCells and FillArea fail as soon as the tiles of
  // all grids take more than `max_growth` bytes of memory more than before.
  SnapshotEditor(Snapshot before, Revision revision,
                 int64_t max_growth = std::numeric_limits<int64_t>::max());

  // The snapshot with its structure as changed so far, and its content and aliases as before.
  const Snapshot& current() const { return *next_; }

  // NOT_FOUND; FAILED_PRECONDITION if the layer is a grid.
  absl::StatusOr<std::shared_ptr<const SemanticLayer>> Semantic(const std::string& layer) const;
  // NOT_FOUND; FAILED_PRECONDITION if the layer is a semantic layer.
  absl::StatusOr<std::shared_ptr<const GridLayer>> Grid(const std::string& layer) const;
  // Returns the object as changed so far; null if there is none.
  ObjectPtr FindObject(const SemanticLayer& layer, ObjectId id) const;
  // Returns an id that no object had before.
  ObjectId NewObjectId() { return next_->next_object_id++; }

  // ALREADY_EXISTS. `spec` must be valid.
  absl::Status CreateLayer(LayerSpec spec);
  // NOT_FOUND. Drops the changes that were collected for the layer.
  absl::Status DeleteLayer(const std::string& layer);
  // Errors are those of FrameTree::Set.
  absl::Status SetTransform(FrameTransform transform);
  // Replaces all aliases of a semantic layer. Errors are those of Semantic.
  absl::Status SetAliases(const std::string& layer, ValueAliases aliases);
  // Replaces the labels of each alias in `changes`, which must be folded, and removes those without
  // labels. Logarithmic in the number of the layer's aliases for each, after the first call for the
  // layer. Errors are those of Semantic and CheckNumLabels.
  absl::Status UpdateAliases(const std::string& layer, const ValueAliases& changes);
  // Sets the extent of a grid. INVALID_ARGUMENT if it would shrink or leave kAllCells. Errors are
  // those of Grid.
  absl::Status GrowExtent(const std::string& layer, const CellBox& extent);
  // `object` must have an id, and its shape in the layer's frame. Errors are those of Semantic.
  absl::Status PutObject(const std::string& layer, ObjectPtr object);
  // Succeeds if there is no such object. Errors are those of Semantic.
  absl::Status RemoveObject(const std::string& layer, ObjectId id);
  // Errors are those of Grid, GridWriter::Write and GridWriter::Fill; after RESOURCE_EXHAUSTED, the
  // editor must not be used any more.
  absl::Status WriteCells(const std::string& layer, const CellBox& box,
                          const std::vector<std::optional<double>>& values);
  absl::Status FillArea(const std::string& layer, const Polygon& area, CellRule rule,
                        std::optional<double> value, int64_t max_cells);

  // Replaces a tile of a grid. Its known cells must be within the extent. Errors are those of Grid.
  // REQUIRES: WriteCells and FillArea are not used for the layer.
  absl::Status PutTile(const std::string& layer, const TileIndex& index, TilePtr tile);

  // Returns the snapshot with everything that was collected, and its changes in an order in which
  // they can be applied. Sets the version of each layer that changed to the revision.
  AppliedBatch Finish() &&;

 private:
  using ObjectChanges = absl::btree_map<ObjectId, ObjectPtr>;  // Null: removed.
  struct AliasesSoFar {
    ValueAliases aliases;
    int64_t num_labels = 0;
  };

  // Returns the layer's writer, its growth limited to what the others leave.
  absl::StatusOr<GridWriter*> Writer(const std::string& layer);
  void FinishAliases(const std::string& layer, ValueAliases aliases);
  void FinishObjects(const std::string& layer, const ObjectChanges& changes);
  void FinishGrid(const std::string& layer, GridWriter writer);
  void FinishTiles(const std::string& layer, const TileMap& tiles);
  void SetVersions();

  std::shared_ptr<Snapshot> next_;
  // Bytes by which tiles may still grow, if no grid is open.
  int64_t max_growth_;
  std::vector<Change> changes_;
  std::map<std::string, AliasesSoFar> aliases_;
  std::map<std::string, ObjectChanges> objects_;
  std::map<std::string, GridWriter> grids_;
  std::map<std::string, TileMap> tiles_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_SNAPSHOT_EDITOR_H_
