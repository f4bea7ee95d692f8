#include "client_libs/cpp/replica/mirrored_map.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/edits/snapshot_editor.h"

namespace hypermap::client {
namespace {

absl::Status Incomplete(const MapChange& change) {
  return absl::InternalError(absl::StrCat("a change of the kind ", ChangeKindName(change.kind),
                                          " of layer \"", change.layer, "\" is incomplete"));
}

absl::Status WriteCells(const MapChange& change, SnapshotEditor& editor) {
  for (const CellRun& run : change.cells) {
    const CellBox box{run.row, run.row + 1, run.col_begin, run.col_end};
    const std::vector<std::optional<double>> values(std::max<int64_t>(box.cols(), 0), run.value);
    HYPERMAP_RETURN_IF_ERROR(editor.WriteCells(change.layer, box, values));
  }
  return absl::OkStatus();
}

absl::Status CreateLayer(const LayerStructure& layer, SnapshotEditor& editor) {
  HYPERMAP_RETURN_IF_ERROR(editor.CreateLayer(layer.spec));
  if (layer.extent.empty()) return absl::OkStatus();
  return editor.GrowExtent(layer.spec.name, layer.extent);
}

absl::Status ChangeLayer(const LayerStructure& layer, SnapshotEditor& editor) {
  if (!layer.spec.grid) return editor.SetAliases(layer.spec.name, layer.spec.aliases);
  if (layer.extent.empty()) return absl::OkStatus();
  return editor.GrowExtent(layer.spec.name, layer.extent);
}

absl::Status CarryOut(const MapChange& change, SnapshotEditor& editor) {
  switch (change.kind) {
    case ChangeKind::kPut:
    case ChangeKind::kEnter:
      if (!change.object) return Incomplete(change);
      return editor.PutObject(change.layer, change.object);
    case ChangeKind::kRemove:
    case ChangeKind::kLeave:
      return editor.RemoveObject(change.layer, change.object_id);
    case ChangeKind::kCells:
      return WriteCells(change, editor);
    case ChangeKind::kLayerCreated:
      if (!change.layer_now) return Incomplete(change);
      return CreateLayer(*change.layer_now, editor);
    case ChangeKind::kLayerDeleted:
      // A layer that was created in the same commit is reported only as deleted.
      if (!editor.current().FindLayer(change.layer)) return absl::OkStatus();
      return editor.DeleteLayer(change.layer);
    case ChangeKind::kLayerChanged:
      if (!change.layer_now) return Incomplete(change);
      return ChangeLayer(*change.layer_now, editor);
    case ChangeKind::kTransform:
      if (!change.transform) return Incomplete(change);
      return editor.SetTransform(*change.transform);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SnapshotPtr> After(const Snapshot& before, const WatchEvent& event) {
  Snapshot start;
  if (event.snapshot) {
    start.map_name = before.map_name;
    start.frame_id = event.map ? event.map->frame_id : before.frame_id;
  } else {
    start = before;
  }
  SnapshotEditor editor(std::move(start), event.revision);
  for (const MapChange& change : event.changes) {
    if (absl::Status status = CarryOut(change, editor); !status.ok()) {
      return absl::InternalError(absl::StrCat("the server's answer: ", status.message()));
    }
  }
  auto after = std::make_shared<Snapshot>(*std::move(editor).Finish().snapshot);
  // The server counts a change even if a later one of the same event undoes it. Snapshots contain
  // the versions themselves.
  for (const MapChange& change : event.changes) {
    const auto version = after->layer_versions.find(change.layer);
    if (version == after->layer_versions.end()) continue;
    if (!event.snapshot) version->second = event.revision;
    if (change.layer_now) version->second = change.layer_now->version;
  }
  return after;
}

}  // namespace hypermap::client
