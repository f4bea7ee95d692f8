#include "map/edits/apply.h"

#include <map>
#include <memory>
#include <utility>

#include "absl/container/btree_map.h"
#include "absl/strings/str_cat.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {
namespace {

absl::Status WithPrefix(absl::string_view prefix, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(prefix, status.message()));
}

// ABORTED when a version is wanted that the object (null: there is none) does not have.
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

// Carries out the edits of one batch on a copy of a snapshot. Content is collected per layer and
// put into new layers once, at the end.
class BatchEditor {
 public:
  BatchEditor(const Snapshot& before, absl::Time time, const EditLimits& limits)
      : next_(std::make_shared<Snapshot>(before)), time_(time), limits_(limits) {
    ++next_->revision;
  }

  // Each returns the id of the object it put, else 0.
  absl::StatusOr<ObjectId> operator()(const CreateLayer& edit);
  absl::StatusOr<ObjectId> operator()(const DeleteLayer& edit);
  absl::StatusOr<ObjectId> operator()(const SetTransform& edit);
  absl::StatusOr<ObjectId> operator()(const PutObject& edit);
  absl::StatusOr<ObjectId> operator()(const DeleteObject& edit);
  absl::StatusOr<ObjectId> operator()(const WriteCells& edit);
  absl::StatusOr<ObjectId> operator()(const FillPolygon& edit);
  absl::StatusOr<ObjectId> operator()(const SetAliases& edit);

  // The snapshot with all that was collected; adds the changes of content to those of structure.
  AppliedBatch Finish() &&;

 private:
  using ObjectChanges = absl::btree_map<ObjectId, ObjectPtr>;  // null: removed

  absl::StatusOr<std::shared_ptr<const SemanticLayer>> Semantic(const std::string& name) const;
  absl::StatusOr<GridWriter*> Grid(const std::string& name);
  // The object as the batch so far left it; null when there is none.
  ObjectPtr FindObject(const SemanticLayer& layer, ObjectId id) const;
  // A polygon or shape in the layer's frame.
  template <typename Geometry>
  absl::StatusOr<Geometry> InLayerFrame(const Layer& layer, const std::string& frame_id,
                                        const Geometry& geometry) const;
  void SetLayerVersion(const TransformSet& /*change*/) {}
  void SetLayerVersion(const LayerDeleted& change) {
    next_->layer_versions.erase(change.spec.name);
  }
  void SetLayerVersion(const LayerCreated& change) { Touch(change.spec.name); }
  template <typename ContentChange>
  void SetLayerVersion(const ContentChange& change) {
    Touch(change.layer);
  }
  void Touch(const std::string& layer) { next_->layer_versions[layer] = next_->revision; }
  void FinishObjects(const std::string& name, const ObjectChanges& changes);
  void FinishGrid(const std::string& name, GridWriter writer);

  std::shared_ptr<Snapshot> next_;
  const absl::Time time_;
  const EditLimits limits_;
  std::vector<Change> changes_;
  std::map<std::string, ObjectChanges> objects_;
  std::map<std::string, GridWriter> grids_;
};

absl::StatusOr<std::shared_ptr<const SemanticLayer>> BatchEditor::Semantic(
    const std::string& name) const {
  absl::StatusOr<LayerPtr> layer = next_->GetLayer(name);
  if (!layer.ok()) return layer.status();
  auto semantic = AsSemantic(*layer);
  if (semantic) return semantic;
  return absl::FailedPreconditionError(absl::StrCat("layer \"", name, "\" is of the kind ",
                                                    LayerKindName((*layer)->spec().kind),
                                                    ", which holds no objects"));
}

absl::StatusOr<GridWriter*> BatchEditor::Grid(const std::string& name) {
  if (const auto open = grids_.find(name); open != grids_.end()) return &open->second;
  absl::StatusOr<LayerPtr> layer = next_->GetLayer(name);
  if (!layer.ok()) return layer.status();
  auto grid = AsGrid(*layer);
  if (grid) return &grids_.emplace(name, GridWriter(std::move(grid))).first->second;
  return absl::FailedPreconditionError(absl::StrCat("layer \"", name, "\" is of the kind ",
                                                    LayerKindName((*layer)->spec().kind),
                                                    ", which holds no cells"));
}

ObjectPtr BatchEditor::FindObject(const SemanticLayer& layer, ObjectId id) const {
  if (const auto changes = objects_.find(layer.spec().name); changes != objects_.end()) {
    if (const auto it = changes->second.find(id); it != changes->second.end()) return it->second;
  }
  return layer.Find(id);
}

template <typename Geometry>
absl::StatusOr<Geometry> BatchEditor::InLayerFrame(const Layer& layer, const std::string& frame_id,
                                                   const Geometry& geometry) const {
  if (frame_id.empty() || frame_id == layer.spec().frame_id) return geometry;
  absl::StatusOr<std::string> frame = next_->ResolveFrame(frame_id);
  if (!frame.ok()) return frame.status();
  absl::StatusOr<PlanarTransform> layer_from_frame =
      next_->frames.Lookup(layer.spec().frame_id, *frame);
  if (!layer_from_frame.ok()) return layer_from_frame.status();
  return *layer_from_frame * geometry;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const CreateLayer& edit) {
  LayerSpec spec = edit.spec;
  if (spec.frame_id.empty()) spec.frame_id = next_->frame_id;
  absl::StatusOr<ValueAliases> aliases = FoldAliases(spec.aliases);
  if (!aliases.ok()) return WithPrefix("layer.", aliases.status());
  spec.aliases = *std::move(aliases);
  if (auto status = Validate(spec); !status.ok()) return status;
  if (next_->FindLayer(spec.name)) {
    return absl::AlreadyExistsError(
        absl::StrCat("map \"", next_->map_name, "\" already has a layer \"", spec.name, "\""));
  }
  changes_.push_back(LayerCreated{spec});
  std::string name = spec.name;
  next_->layers.emplace(std::move(name), MakeEmptyLayer(std::move(spec)));
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const DeleteLayer& edit) {
  absl::StatusOr<LayerPtr> layer = next_->GetLayer(edit.layer);
  if (!layer.ok()) return layer.status();
  objects_.erase(edit.layer);
  grids_.erase(edit.layer);
  changes_.push_back(LayerDeleted{(*layer)->spec()});
  next_->layers.erase(edit.layer);
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const SetTransform& edit) {
  FrameTransform transform = edit.transform;
  if (transform.parent_frame_id.empty()) transform.parent_frame_id = next_->frame_id;
  if (auto status = next_->frames.Set(transform); !status.ok()) return status;
  changes_.push_back(TransformSet{std::move(transform)});
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const PutObject& edit) {
  absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = Semantic(edit.layer);
  if (!layer.ok()) return layer.status();
  if (auto status = Validate(edit.object); !status.ok()) return status;
  if (!(*layer)->spec().shape_kinds.Contains(edit.object.shape.kind())) {
    return absl::InvalidArgumentError(absl::StrCat("object.shape: layer \"", edit.layer,
                                                   "\" takes no shapes of the kind ",
                                                   ShapeKindName(edit.object.shape.kind())));
  }
  absl::StatusOr<Shape> shape = InLayerFrame(**layer, edit.frame_id, edit.object.shape);
  if (!shape.ok()) return shape.status();
  if (auto status = CheckVersion(edit.layer, edit.object.id, edit.if_version,
                                 FindObject(**layer, edit.object.id));
      !status.ok()) {
    return status;
  }
  const bool may_revive = edit.revive && edit.object.id < next_->next_object_id;
  if (edit.object.id != 0 && !may_revive && !FindObject(**layer, edit.object.id)) {
    return absl::NotFoundError(
        absl::StrCat("layer \"", edit.layer, "\" has no object ", edit.object.id));
  }
  auto object = std::make_shared<SemanticObject>(edit.object);
  object->shape = *std::move(shape);
  if (object->id == 0) object->id = next_->next_object_id++;
  const ObjectId id = object->id;
  object->version = next_->revision;
  if (edit.time_to_live) {
    if (*edit.time_to_live <= absl::ZeroDuration()) {
      return absl::InvalidArgumentError("time_to_live: not positive");
    }
    object->expires_at = time_ + *edit.time_to_live;
  }
  objects_[edit.layer][id] = std::move(object);
  return id;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const DeleteObject& edit) {
  absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = Semantic(edit.layer);
  if (!layer.ok()) return layer.status();
  const ObjectPtr object = FindObject(**layer, edit.id);
  if (auto status = CheckVersion(edit.layer, edit.id, edit.if_version, object); !status.ok()) {
    return status;
  }
  if (!object) {
    return absl::NotFoundError(absl::StrCat("layer \"", edit.layer, "\" has no object ", edit.id));
  }
  objects_[edit.layer][edit.id] = nullptr;
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const WriteCells& edit) {
  absl::StatusOr<GridWriter*> grid = Grid(edit.layer);
  if (!grid.ok()) return grid.status();
  if (auto status = (*grid)->Write(edit.box, edit.values); !status.ok()) return status;
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const FillPolygon& edit) {
  absl::StatusOr<GridWriter*> grid = Grid(edit.layer);
  if (!grid.ok()) return grid.status();
  const Layer& layer = *next_->FindLayer(edit.layer);
  absl::StatusOr<Polygon> area = InLayerFrame(layer, edit.frame_id, edit.area);
  if (!area.ok()) return area.status();
  auto status = (*grid)->Fill(*area, edit.rule, edit.value, limits_.max_cells_per_fill);
  if (!status.ok()) return status;
  return 0;
}

absl::StatusOr<ObjectId> BatchEditor::operator()(const SetAliases& edit) {
  absl::StatusOr<std::shared_ptr<const SemanticLayer>> layer = Semantic(edit.layer);
  if (!layer.ok()) return layer.status();
  const absl::StatusOr<ValueAliases> changes = FoldAliases(edit.aliases);
  if (!changes.ok()) return changes.status();
  const ValueAliases& before = (*layer)->spec().aliases;
  ValueAliases after = before;
  Update(after, *changes);
  if (auto status = Validate(after); !status.ok()) return status;
  changes_.push_back(AliasesSet{edit.layer, before, after});
  next_->layers[edit.layer] = (*layer)->WithAliases(std::move(after));
  return 0;
}

void BatchEditor::FinishObjects(const std::string& name, const ObjectChanges& changes) {
  const auto& layer = static_cast<const SemanticLayer&>(*next_->FindLayer(name));
  for (const auto& [id, after] : changes) {
    const ObjectPtr before = layer.Find(id);
    if (after) {
      changes_.push_back(ObjectPut{name, before, after});
    } else if (before) {
      changes_.push_back(ObjectRemoved{name, before});
    }
  }
  next_->layers[name] = layer.With(changes);
}

void BatchEditor::FinishGrid(const std::string& name, GridWriter writer) {
  const CellBox extent_before = static_cast<const GridLayer&>(*next_->FindLayer(name)).extent();
  GridWriter::Result result = std::move(writer).Finish();
  if (result.layer->extent() != extent_before) {
    changes_.push_back(ExtentGrown{name, result.layer->extent()});
  }
  for (auto& [index, tile] : result.written) {
    changes_.push_back(TileWritten{name, index, std::move(tile.before), std::move(tile.after)});
  }
  next_->layers[name] = std::move(result.layer);
}

AppliedBatch BatchEditor::Finish() && {
  for (const auto& [name, changes] : objects_) FinishObjects(name, changes);
  for (auto& [name, writer] : grids_) FinishGrid(name, std::move(writer));
  for (const Change& change : changes_) {
    std::visit([this](const auto& c) { SetLayerVersion(c); }, change);
  }
  AppliedBatch applied;
  applied.snapshot = std::move(next_);
  applied.changes = std::move(changes_);
  return applied;
}

}  // namespace

absl::StatusOr<AppliedBatch> Apply(const Snapshot& before, const EditBatch& batch,
                                   const EditLimits& limits) {
  if (batch.edits.empty()) return absl::InvalidArgumentError("edits is empty");
  for (const LayerVersion& wanted : batch.if_layers) {
    const absl::StatusOr<LayerPtr> layer = before.GetLayer(wanted.layer);
    if (!layer.ok()) return WithPrefix("if_layers: ", layer.status());
    const Revision version = before.LayerVersionOf(wanted.layer);
    if (version == wanted.version) continue;
    return absl::AbortedError(absl::StrCat("if_layers: layer \"", wanted.layer, "\" has version ",
                                           version, ", not ", wanted.version));
  }
  BatchEditor editor(before, batch.time, limits);
  std::vector<ObjectId> object_ids;
  object_ids.reserve(batch.edits.size());
  for (const Edit& edit : batch.edits) {
    const absl::StatusOr<ObjectId> id = std::visit(editor, edit);
    if (!id.ok()) return WithPrefix(absl::StrCat("edits[", object_ids.size(), "]: "), id.status());
    object_ids.push_back(*id);
  }
  AppliedBatch applied = std::move(editor).Finish();
  applied.object_ids = std::move(object_ids);
  return applied;
}

}  // namespace hypermap
