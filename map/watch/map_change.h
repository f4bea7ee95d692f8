// Changes of a map as a subscriber sees them; also the result of comparing two revisions.
#ifndef HYPERMAP_MAP_WATCH_MAP_CHANGE_H_
#define HYPERMAP_MAP_WATCH_MAP_CHANGE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "map/frames/frame_tree.h"
#include "map/grid/grid_geometry.h"
#include "map/objects/semantic_object.h"
#include "map/structure.h"

namespace hypermap {

enum class ChangeKind {
  kPut,     // An object is new or has changed.
  kRemove,  // An object was removed.
  kEnter,   // An existing object is selected from now on.
  kLeave,   // An existing object is no longer selected.
  kCells,
  kLayerCreated,
  kLayerDeleted,
  kLayerChanged,  // Its aliases, or the extent of its grid.
  kTransform,
};

// Returns "put", "remove", "enter", "leave", "cells", "layer_created", "layer_deleted",
// "layer_changed" or "transform".
absl::string_view ChangeKindName(ChangeKind kind);

// One change of the part of the map that a subscriber follows, in the subscriber's frame. In
// contrast, map/edits/change.h describes changes of the map as stored.
struct MapChange {
  ChangeKind kind = ChangeKind::kPut;
  std::string layer;
  // Transforms the objects and cells below to the subscriber's frame. Identity in changes that a
  // client has received, which are in that frame already.
  PlanarTransform caller_from_layer;
  // For changes of objects.
  ObjectId object_id = 0;
  ObjectPtr object;         // For kPut and kEnter: the object after the change.
  ObjectPtr object_before;  // For a comparison's kPut (null if new) and kRemove: the object before.
  // For kCells: the cells that changed, by row and column.
  std::optional<GridGeometry> grid;
  std::vector<CellRun> cells;
  std::vector<CellRun> cells_before;        // In a comparison: the same cells before.
  std::optional<LayerStructure> layer_now;  // For kLayerCreated and kLayerChanged.
  std::optional<FrameTransform> transform;  // For kTransform.
};

// Memory of a change, without its objects, which are shared with the map: an estimate.
int64_t ByteSize(const MapChange& change);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_WATCH_MAP_CHANGE_H_
