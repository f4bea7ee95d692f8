// The changes that an edit batch makes to a map as stored. They are written to the store, and
// watches are derived from them.
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
// All aliases of a layer, before and after.
struct AliasesSet {
  std::string layer;
  ValueAliases before;
  ValueAliases after;
};
struct ObjectPut {
  std::string layer;
  ObjectPtr before;  // Null if new.
  ObjectPtr after;   // Its shape is in the layer's frame.
};
struct ObjectRemoved {
  std::string layer;
  ObjectPtr before;
};
struct TileWritten {
  std::string layer;
  TileIndex index;
  TilePtr before;  // Null if new.
  TilePtr after;
};
// The extent of a grid that has grown.
struct ExtentGrown {
  std::string layer;
  CellBox extent;
};

using Change = std::variant<LayerCreated, LayerDeleted, TransformSet, ObjectPut, ObjectRemoved,
                            TileWritten, ExtentGrown, AliasesSet>;

// The result of a batch: the next snapshot, and its difference from the one before. Changes are in
// an order in which they can be applied. An object or tile that was changed twice appears once.
struct AppliedBatch {
  SnapshotPtr snapshot;
  std::vector<Change> changes;
  // For each edit of the batch, in order: the id of the object that it put, or 0.
  std::vector<ObjectId> object_ids;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_CHANGE_H_
