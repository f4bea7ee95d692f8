#include "map/edits/apply.h"

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/edits/batch_cells.h"
#include "map/edits/snapshot_editor.h"
#include "map/frames/frame_bounds.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {
namespace {

absl::Status WithPrefix(absl::string_view prefix, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(prefix, status.message()));
}

// Returns ABORTED if a version is required that the object does not have, or the object is null.
absl::Status CheckVersion(const std::string& layer, ObjectId id, std::optional<Revision> wanted,
                          const ObjectPtr& object) {
  if (!wanted || (object && object->version == *wanted)) return absl::OkStatus();
  if (!object) {
    return absl::AbortedError(absl::StrCat("layer \"", layer, "\" has no object ", id,
                                           ", which should have version ", *wanted));
  }
  return absl::AbortedError(absl::StrCat("object ", id, " of layer \"", layer, "\" has version ",
                                         object->version, ", not ", *wanted));
}

// Checks and applies the edits of one batch, one after the other.
class BatchEditor {
 public:
  BatchEditor(const Snapshot& before, absl::Time time, const Limits& limits, int64_t max_growth)
      : editor_(before, before.revision + 1, max_growth), time_(time), limits_(limits) {}

  // Each returns the id of the object that it put, or 0.
  absl::StatusOr<ObjectId> operator()(const CreateLayer& edit);
  absl::StatusOr<ObjectId> operator()(const DeleteLayer& edit);
  absl::StatusOr<ObjectId> operator()(const SetTransform& edit);
  absl::StatusOr<ObjectId> operator()(const PutObject& edit);
  absl::StatusOr<ObjectId> operator()(const DeleteObject& edit);
  absl::StatusOr<ObjectId> operator()(const WriteCells& edit);
  absl::StatusOr<ObjectId> operator()(const FillPolygon& edit);
  absl::StatusOr<ObjectId> operator()(const SetAliases& edit);

  AppliedBatch Finish() && { return std::move(editor_).Finish(); }

 private:
  const Snapshot& current() const { return editor_.current(); }
  // Returns the transform to the layer's frame; an empty `frame_id` is the layer's frame itself.
  absl::StatusOr<PlanarTransform> LayerFromFrame(const Layer& layer,
                                                 const std::string& frame_id) const;

  SnapshotEditor editor_;
  FrameBounds frame_bounds_;
  const absl::Time time_;
  const Limits limits_;
};

absl::StatusOr<PlanarTransform> BatchEditor::LayerFromFrame(const Layer& layer,
                                                            const std::string& frame_id) const {
  if (frame_id.empty() || frame_id == layer.spec().frame_id) return PlanarTransform();
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, current().ResolveFrame(frame_id));
  return current().frames.Lookup(layer.spec().frame_id, frame);
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const CreateLayer& edit) {
  LayerSpec spec = edit.spec;
  if (spec.frame_id.empty()) spec.frame_id = current().frame_id;
  absl::StatusOr<ValueAliases> aliases = FoldAliases(spec.aliases);
  if (!aliases.ok()) return WithPrefix("layer.", aliases.status());
  spec.aliases = *std::move(aliases);
  HYPERMAP_RETURN_IF_ERROR(Validate(spec));
  if (spec.grid) {
    HYPERMAP_RETURN_IF_ERROR(CheckTranslation("layer.grid.origin", spec.grid->layer_from_grid));
  }
  HYPERMAP_RETURN_IF_ERROR(editor_.CreateLayer(std::move(spec)));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const DeleteLayer& edit) {
  HYPERMAP_RETURN_IF_ERROR(editor_.DeleteLayer(edit.layer));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const SetTransform& edit) {
  FrameTransform transform = edit.transform;
  if (transform.parent_frame_id.empty()) transform.parent_frame_id = current().frame_id;
  HYPERMAP_RETURN_IF_ERROR(frame_bounds_.Check(current().frames, transform));
  HYPERMAP_RETURN_IF_ERROR(editor_.SetTransform(std::move(transform)));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const PutObject& edit) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto layer, editor_.Semantic(edit.layer));
  HYPERMAP_RETURN_IF_ERROR(Validate(edit.object));
  if (!layer->spec().shape_kinds.Contains(edit.object.shape.kind())) {
    return absl::InvalidArgumentError(absl::StrCat("object.shape: layer \"", edit.layer,
                                                   "\" takes no shapes of the kind ",
                                                   ShapeKindName(edit.object.shape.kind())));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform layer_from_frame,
                            LayerFromFrame(*layer, edit.frame_id));
  absl::StatusOr<Shape> shape = Moved(layer_from_frame, edit.object.shape);
  if (!shape.ok()) {
    return WithPrefix(absl::StrCat("object.shape: in frame \"", layer->spec().frame_id, "\": "),
                      shape.status());
  }
  const ObjectPtr before = editor_.FindObject(*layer, edit.object.id);
  HYPERMAP_RETURN_IF_ERROR(CheckVersion(edit.layer, edit.object.id, edit.if_version, before));
  const bool may_revive = edit.revive && edit.object.id < current().next_object_id;
  if (edit.object.id != 0 && !may_revive && !before) {
    return absl::NotFoundError(
        absl::StrCat("layer \"", edit.layer, "\" has no object ", edit.object.id));
  }
  if (edit.time_to_live && *edit.time_to_live <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError("time_to_live: not positive");
  }
  auto object = std::make_shared<SemanticObject>(edit.object);
  object->shape = *std::move(shape);
  if (object->id == 0) object->id = editor_.NewObjectId();
  object->version = current().revision;
  if (edit.time_to_live) object->expires_at = time_ + *edit.time_to_live;
  const ObjectId id = object->id;
  HYPERMAP_RETURN_IF_ERROR(editor_.PutObject(edit.layer, std::move(object)));
  return id;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const DeleteObject& edit) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto layer, editor_.Semantic(edit.layer));
  const ObjectPtr object = editor_.FindObject(*layer, edit.id);
  HYPERMAP_RETURN_IF_ERROR(CheckVersion(edit.layer, edit.id, edit.if_version, object));
  if (!object) {
    return absl::NotFoundError(absl::StrCat("layer \"", edit.layer, "\" has no object ", edit.id));
  }
  HYPERMAP_RETURN_IF_ERROR(editor_.RemoveObject(edit.layer, edit.id));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const WriteCells& edit) {
  HYPERMAP_RETURN_IF_ERROR(editor_.WriteCells(edit.layer, edit.box, edit.values));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const FillPolygon& edit) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto grid, editor_.Grid(edit.layer));
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform layer_from_area,
                            LayerFromFrame(*grid, edit.frame_id));
  // An area that is moved too far leaves the grid's cells, which is an error.
  HYPERMAP_RETURN_IF_ERROR(editor_.FillArea(edit.layer, layer_from_area * edit.area, edit.rule,
                                            edit.value, limits_.max_cells));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const SetAliases& edit) {
  HYPERMAP_RETURN_IF_ERROR(editor_.Semantic(edit.layer).status());
  HYPERMAP_ASSIGN_OR_RETURN(const ValueAliases changes, FoldAliases(edit.aliases));
  HYPERMAP_RETURN_IF_ERROR(editor_.UpdateAliases(edit.layer, changes));
  return 0;
}

}  // namespace

absl::StatusOr<AppliedBatch> Apply(const Snapshot& before, const EditBatch& batch,
                                   const Limits& limits, int64_t max_growth) {
  HYPERMAP_RETURN_IF_ERROR(CheckCells(before, batch, limits.max_cells));
  return ApplyExtended(before, batch, limits, max_growth);
}

absl::StatusOr<AppliedBatch> ApplyExtended(const Snapshot& before, const EditBatch& batch,
                                           const Limits& limits, int64_t max_growth) {
  if (batch.edits.empty()) return absl::InvalidArgumentError("edits is empty");
  for (const LayerVersion& wanted : batch.if_layers) {
    const absl::StatusOr<LayerPtr> layer = before.GetLayer(wanted.layer);
    if (!layer.ok()) return WithPrefix("if_layers: ", layer.status());
    const Revision version = before.LayerVersionOf(wanted.layer);
    if (version == wanted.version) continue;
    return absl::AbortedError(absl::StrCat("if_layers: layer \"", wanted.layer, "\" has version ",
                                           version, ", not ", wanted.version));
  }
  BatchEditor editor(before, batch.time, limits, max_growth);
  std::vector<ObjectId> object_ids;
  object_ids.reserve(batch.edits.size());
  for (const Edit& edit : batch.edits) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const absl::StatusOr<ObjectId> id = std::visit(editor, edit);
    if (!id.ok()) return WithPrefix(absl::StrCat("edits[", object_ids.size(), "]: "), id.status());
    object_ids.push_back(*id);
  }
  AppliedBatch applied = std::move(editor).Finish();
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  applied.object_ids = std::move(object_ids);
  return applied;
}

}  // namespace hypermap
