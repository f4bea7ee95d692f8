#include "map/edits/replay.h"

#include <utility>
#include <variant>

#include "base/status/status_macros.h"
#include "map/edits/snapshot_editor.h"

namespace hypermap {
namespace {

// Hands a change to the editor.
struct ReplayOne {
  absl::Status operator()(const LayerCreated& c) { return editor.CreateLayer(c.spec); }
  absl::Status operator()(const LayerDeleted& c) { return editor.DeleteLayer(c.spec.name); }
  absl::Status operator()(const TransformSet& c) { return editor.SetTransform(c.transform); }
  absl::Status operator()(const ObjectPut& c) { return editor.PutObject(c.layer, c.after); }
  absl::Status operator()(const ObjectRemoved& c) {
    return editor.RemoveObject(c.layer, c.before->id);
  }
  absl::Status operator()(const TileWritten& c) {
    return editor.PutTile(c.layer, c.index, c.after);
  }
  absl::Status operator()(const ExtentGrown& c) { return editor.GrowExtent(c.layer, c.extent); }
  absl::Status operator()(const AliasesSet& c) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto layer, editor.Semantic(c.layer));
    ValueAliases aliases = layer->spec().aliases;
    CarryOut(c, &aliases);
    return editor.SetAliases(c.layer, std::move(aliases));
  }

  SnapshotEditor& editor;
};

}  // namespace

absl::StatusOr<SnapshotPtr> Replay(Snapshot before, Revision revision,
                                   absl::Span<const Change> changes) {
  SnapshotEditor editor(std::move(before), revision);
  for (const Change& change : changes) {
    HYPERMAP_RETURN_IF_ERROR(std::visit(ReplayOne{editor}, change));
  }
  return std::move(editor).Finish().snapshot;
}

}  // namespace hypermap
