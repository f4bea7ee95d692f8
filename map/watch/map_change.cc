#include "map/watch/map_change.h"

namespace hypermap {

absl::string_view ChangeKindName(ChangeKind kind) {
  switch (kind) {
    case ChangeKind::kPut:
      return "put";
    case ChangeKind::kRemove:
      return "remove";
    case ChangeKind::kEnter:
      return "enter";
    case ChangeKind::kLeave:
      return "leave";
    case ChangeKind::kCells:
      return "cells";
    case ChangeKind::kLayerCreated:
      return "layer_created";
    case ChangeKind::kLayerDeleted:
      return "layer_deleted";
    case ChangeKind::kLayerChanged:
      return "layer_changed";
    case ChangeKind::kTransform:
      return "transform";
  }
  return "";
}

int64_t ByteSize(const MapChange& change) {
  const size_t runs = change.cells.size() + change.cells_before.size();
  return static_cast<int64_t>(sizeof(change) + change.layer.size() + runs * sizeof(CellRun));
}

}  // namespace hypermap
