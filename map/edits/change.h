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
// The aliases of a layer that differ: with their labels before the change (without those that are
// new) and after it (without those that were removed). Other aliases stay. With `before` and
// `after` exchanged it is the inverse change. Earlier versions stored all aliases of the layer in
// both, which has the same effect.
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

// Returns the change that turns `before` into `after`. Cheap for aliases that they share.
AliasesSet ChangeOfAliases(std::string layer, const ValueAliases& before,
                           const ValueAliases& after);

// Applies the change to the aliases of its layer.
void CarryOut(const AliasesSet& change, ValueAliases* aliases);

// The result of a batch: the next snapshot, and its difference from the one before. Changes are in
// an order in which they can be applied. An object, a tile or the aliases of a layer that were
// changed twice appear once.
struct AppliedBatch {
  SnapshotPtr snapshot;
  std::vector<Change> changes;
  // For each edit of the batch, in order: the id of the object that it put, or 0.
  std::vector<ObjectId> object_ids;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_CHANGE_H_
