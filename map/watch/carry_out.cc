#include "map/watch/carry_out.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/edits/snapshot_editor.h"

namespace hypermap {
namespace {

absl::Status Unfit(const MapChange& change, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat("a change of the kind ",
                                                 ChangeKindName(change.kind), " of layer \"",
                                                 change.layer, "\" ", problem));
}

absl::Status Incomplete(const MapChange& change) { return Unfit(change, "is incomplete"); }

absl::Status CarryOutCells(const MapChange& change, SnapshotEditor& editor) {
  for (const CellRun& run : change.cells) {
    // Before memory is taken for all cells of the run.
    if (!kAllCells.Contains(CellIndex{run.row, run.col_begin}) || run.col_end > kMaxCellIndex) {
      return Unfit(change, "has cells beyond those of a grid");
    }
    const CellBox box{run.row, run.row + 1, run.col_begin, run.col_end};
    const std::vector<std::optional<double>> values(std::max<int64_t>(box.cols(), 0), run.value);
    HYPERMAP_RETURN_IF_ERROR(editor.WriteCells(change.layer, box, values));
  }
  return absl::OkStatus();
}

absl::Status CarryOutPut(const MapChange& change, SnapshotEditor& editor) {
  if (!change.object) return Incomplete(change);
  // The next id of the map is one more.
  constexpr ObjectId kMaxId = std::numeric_limits<ObjectId>::max() - 1;
  if (change.object->id <= 0 || change.object->id > kMaxId) {
    return Unfit(change, "has an object without a valid id");
  }
  return editor.PutObject(change.layer, change.object);
}

absl::Status AddLayer(const LayerStructure& layer, SnapshotEditor& editor) {
  HYPERMAP_RETURN_IF_ERROR(editor.CreateLayer(layer.spec));
  if (layer.extent.empty()) return absl::OkStatus();
  return editor.GrowExtent(layer.spec.name, layer.extent);
}

absl::Status ChangeLayer(const LayerStructure& layer, SnapshotEditor& editor) {
  if (!layer.spec.grid) return editor.SetAliases(layer.spec.name, layer.spec.aliases);
  if (layer.extent.empty()) return absl::OkStatus();
  return editor.GrowExtent(layer.spec.name, layer.extent);
}

absl::Status CarryOutOne(const MapChange& change, SnapshotEditor& editor) {
  switch (change.kind) {
    case ChangeKind::kPut:
    case ChangeKind::kEnter:
      return CarryOutPut(change, editor);
    case ChangeKind::kRemove:
    case ChangeKind::kLeave:
      return editor.RemoveObject(change.layer, change.object_id);
    case ChangeKind::kCells:
      return CarryOutCells(change, editor);
    case ChangeKind::kLayerCreated:
      if (!change.layer_now) return Incomplete(change);
      return AddLayer(*change.layer_now, editor);
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

// The editor sets the versions of layers whose content differs at the end. The map also counts a
// change that a later one of the same commit undoes, and a layer of a selection is older than the
// selection's revision.
void SetVersions(absl::Span<const MapChange> changes, Snapshot& snapshot) {
  const auto set = [&snapshot](const std::string& layer, Revision version) {
    const auto found = snapshot.layer_versions.find(layer);
    if (found != snapshot.layer_versions.end()) found->second = version;
  };
  for (const MapChange& change : changes) set(change.layer, snapshot.revision);
  for (const MapChange& change : changes) {
    if (change.layer_now) set(change.layer, change.layer_now->version);
  }
}

}  // namespace

absl::StatusOr<SnapshotPtr> CarryOut(Snapshot before, Revision revision,
                                     absl::Span<const MapChange> changes) {
  SnapshotEditor editor(std::move(before), revision);
  for (const MapChange& change : changes) {
    HYPERMAP_RETURN_IF_ERROR(CarryOutOne(change, editor));
  }
  auto after = std::make_shared<Snapshot>(*std::move(editor).Finish().snapshot);
  SetVersions(changes, *after);
  return after;
}

}  // namespace hypermap
