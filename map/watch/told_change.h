// What those who follow a map are told of its changes.
#ifndef HYPERMAP_MAP_WATCH_TOLD_CHANGE_H_
#define HYPERMAP_MAP_WATCH_TOLD_CHANGE_H_

#include <optional>
#include <string>
#include <vector>

#include "map/frames/frame_tree.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer.h"
#include "map/snapshot.h"

namespace hypermap {

enum class ChangeKind {
  kPut,     // an object is new, or is not as it was
  kRemove,  // an object is not on the map any more
  kEnter,   // an object that was there before is selected now
  kLeave,   // an object that is still there is not selected any more
  kCells,
  kLayerCreated,
  kLayerDeleted,
  kLayerChanged,  // its aliases, or the extent of its grid
  kTransform,
};

// "put", "remove", "enter", "leave", "cells", "layer_created", "layer_deleted", "layer_changed",
// "transform".
absl::string_view ChangeKindName(ChangeKind kind);

struct ToldChange {
  ChangeKind kind = ChangeKind::kPut;
  std::string layer;
  // Takes objects and cells, which are in the layer's frame, to the caller's.
  PlanarTransform caller_from_layer;
  // Of objects.
  ObjectId object_id = 0;
  ObjectPtr object;         // kPut, kEnter: as it is now
  ObjectPtr object_before;  // kPut (null when new), kRemove: as it was, where that is told
  // kCells: those that are not as they were, by row and column.
  std::optional<GridGeometry> grid;
  std::vector<CellRun> cells;
  std::vector<CellRun> cells_before;  // the same cells, where that is told
  // kLayerCreated, kLayerChanged.
  LayerPtr layer_now;
  Revision layer_version = 0;
  // kTransform.
  std::optional<FrameTransform> transform;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_TOLD_CHANGE_H_
