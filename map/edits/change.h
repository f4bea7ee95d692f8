// What an edit batch did to a map: the facts that are stored, and that a feed would tell.
#ifndef HYPERMAP_MAP_EDITS_CHANGE_H_
#define HYPERMAP_MAP_EDITS_CHANGE_H_

#include <string>
#include <variant>
#include <vector>

#include "map/frames/frame_tree.h"
#include "map/grid/tile.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"

namespace hypermap {

struct LayerCreated {
  LayerSpec spec;
};
struct LayerDeleted {
  LayerSpec spec;
};
struct TransformSet {
  FrameTransform transform;
};
// All aliases of a layer, as they are now.
struct AliasesSet {
  std::string layer;
  ValueAliases before;
  ValueAliases after;
};
struct ObjectPut {
  std::string layer;
  ObjectPtr before;  // null when new
  ObjectPtr after;   // shape in the layer's frame
};
struct ObjectRemoved {
  std::string layer;
  ObjectPtr before;
};
struct TileWritten {
  std::string layer;
  TileIndex index;
  TilePtr before;  // null when new
  TilePtr after;
};
// The extent of a grid after the batch, where it grew.
struct ExtentGrown {
  std::string layer;
  CellBox extent;
};

using Change = std::variant<LayerCreated, LayerDeleted, TransformSet, ObjectPut, ObjectRemoved,
                            TileWritten, ExtentGrown, AliasesSet>;

// The result of a batch: the next snapshot, and how it differs from the one before. Changes are in
// an order in which they can be carried out; an object or tile touched twice appears once.
struct AppliedBatch {
  SnapshotPtr snapshot;
  std::vector<Change> changes;
  // One for each edit of the batch, in order: the id of the object put, else 0.
  std::vector<ObjectId> object_ids;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_CHANGE_H_
