#include "map/edits/snapshot_editor.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"

namespace hypermap {

SnapshotEditor::SnapshotEditor(Snapshot before, Revision revision, int64_t max_growth)
    : next_(std::make_shared<Snapshot>(std::move(before))), max_growth_(max_growth) {
  next_->revision = revision;
}

absl::StatusOr<std::shared_ptr<const SemanticLayer>> SnapshotEditor::Semantic(
    const std::string& layer) const {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr found, next_->GetLayer(layer));
  if (auto semantic = AsSemantic(found)) return semantic;
  return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is of the kind ",
                                                    LayerKindName(found->spec().kind),
                                                    ", which holds no objects"));
}

absl::StatusOr<std::shared_ptr<const GridLayer>> SnapshotEditor::Grid(
    const std::string& layer) const {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr found, next_->GetLayer(layer));
  if (auto grid = AsGrid(found)) return grid;
  return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is of the kind ",
                                                    LayerKindName(found->spec().kind),
                                                    ", which holds no cells"));
}

absl::StatusOr<GridWriter*> SnapshotEditor::Writer(const std::string& layer) {
  auto writer = grids_.find(layer);
  if (writer == grids_.end()) {
    HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const GridLayer> grid, Grid(layer));
    writer = grids_.emplace(layer, GridWriter(std::move(grid))).first;
  }
  if (max_growth_ != std::numeric_limits<int64_t>::max()) {
    int64_t left = max_growth_ + writer->second.growth();
    for (const auto& [name, open] : grids_) left -= open.growth();
    writer->second.LimitGrowth(left);
  }
  return &writer->second;
}

ObjectPtr SnapshotEditor::FindObject(const SemanticLayer& layer, ObjectId id) const {
  if (const auto changes = objects_.find(layer.spec().name); changes != objects_.end()) {
    if (const auto it = changes->second.find(id); it != changes->second.end()) return it->second;
  }
  return layer.Find(id);
}

absl::Status SnapshotEditor::CreateLayer(LayerSpec spec) {
  if (next_->HasLayer(spec.name)) {
    return absl::AlreadyExistsError(
        absl::StrCat("map \"", next_->map_name, "\" already has a layer \"", spec.name, "\""));
  }
  changes_.push_back(LayerCreated{spec});
  std::string name = spec.name;
  next_->layers.emplace(std::move(name), MakeEmptyLayer(std::move(spec)));
  return absl::OkStatus();
}

absl::Status SnapshotEditor::DeleteLayer(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr found, next_->GetLayer(layer));
  aliases_.erase(layer);
  objects_.erase(layer);
  grids_.erase(layer);
  tiles_.erase(layer);
  if (max_growth_ != std::numeric_limits<int64_t>::max()) max_growth_ += found->ByteSize();
  changes_.push_back(LayerDeleted{found->spec()});
  next_->layers.erase(layer);
  return absl::OkStatus();
}

absl::Status SnapshotEditor::SetTransform(FrameTransform transform) {
  HYPERMAP_RETURN_IF_ERROR(next_->frames.Set(transform));
  changes_.push_back(TransformSet{std::move(transform)});
  return absl::OkStatus();
}

absl::Status SnapshotEditor::SetAliases(const std::string& layer, ValueAliases aliases) {
  HYPERMAP_RETURN_IF_ERROR(Semantic(layer).status());
  const int64_t num_labels = NumLabels(aliases);
  aliases_.insert_or_assign(layer, AliasesSoFar{std::move(aliases), num_labels});
  return absl::OkStatus();
}

absl::Status SnapshotEditor::UpdateAliases(const std::string& layer, const ValueAliases& changes) {
  auto so_far = aliases_.find(layer);
  if (so_far == aliases_.end()) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto semantic, Semantic(layer));
    const ValueAliases& before = semantic->spec().aliases;
    so_far = aliases_.emplace(layer, AliasesSoFar{before, NumLabels(before)}).first;
  }
  auto& [aliases, num_labels] = so_far->second;
  int64_t num_after = num_labels;
  for (const auto& [alias, labels] : changes) {
    const auto before = aliases.find(alias);
    if (before != aliases.end()) num_after -= static_cast<int64_t>(before->second.size());
    num_after += static_cast<int64_t>(labels.size());
  }
  HYPERMAP_RETURN_IF_ERROR(CheckNumLabels(num_after));
  Update(aliases, changes);
  num_labels = num_after;
  return absl::OkStatus();
}

absl::Status SnapshotEditor::GrowExtent(const std::string& layer, const CellBox& extent) {
  // Finish the open writer first: it has the extent that the grid had when the writer was made.
  if (auto writer = grids_.extract(layer)) FinishGrid(layer, std::move(writer.mapped()));
  HYPERMAP_ASSIGN_OR_RETURN(const auto grid, Grid(layer));
  if (!kAllCells.Contains(extent) || !extent.Contains(grid->extent())) {
    return absl::InvalidArgumentError(
        absl::StrCat("the extent of layer \"", layer, "\" shrinks or leaves the cells of a grid"));
  }
  changes_.push_back(ExtentGrown{layer, extent});
  next_->layers[layer] =
      std::make_shared<GridLayer>(grid->spec(), grid->shared_domain(), grid->tiles(), extent);
  return absl::OkStatus();
}

absl::Status SnapshotEditor::PutObject(const std::string& layer, ObjectPtr object) {
  HYPERMAP_RETURN_IF_ERROR(Semantic(layer).status());
  next_->next_object_id = std::max(next_->next_object_id, object->id + 1);
  const ObjectId id = object->id;
  objects_[layer][id] = std::move(object);
  return absl::OkStatus();
}

absl::Status SnapshotEditor::RemoveObject(const std::string& layer, ObjectId id) {
  HYPERMAP_RETURN_IF_ERROR(Semantic(layer).status());
  next_->next_object_id = std::max(next_->next_object_id, id + 1);
  objects_[layer][id] = nullptr;
  return absl::OkStatus();
}

absl::Status SnapshotEditor::WriteCells(const std::string& layer, const CellBox& box,
                                        const std::vector<std::optional<double>>& values) {
  HYPERMAP_ASSIGN_OR_RETURN(GridWriter* const writer, Writer(layer));
  return writer->Write(box, values);
}

absl::Status SnapshotEditor::FillArea(const std::string& layer, const Polygon& area, CellRule rule,
                                      std::optional<double> value, int64_t max_cells) {
  HYPERMAP_ASSIGN_OR_RETURN(GridWriter* const writer, Writer(layer));
  return writer->Fill(area, rule, value, max_cells);
}

absl::Status SnapshotEditor::PutTile(const std::string& layer, const TileIndex& index,
                                     TilePtr tile) {
  HYPERMAP_RETURN_IF_ERROR(Grid(layer).status());
  tiles_[layer].insert_or_assign(index, std::move(tile));
  return absl::OkStatus();
}

void SnapshotEditor::FinishAliases(const std::string& layer, ValueAliases aliases) {
  const SemanticLayer& before = *next_->FindSemantic(layer);
  changes_.push_back(ChangeOfAliases(layer, before.spec().aliases, aliases));
  next_->layers[layer] = before.WithAliases(std::move(aliases));
}

void SnapshotEditor::FinishObjects(const std::string& layer, const ObjectChanges& changes) {
  const SemanticLayer& before = *next_->FindSemantic(layer);
  for (const auto& [id, after] : changes) {
    if (IsCancelled()) return;
    ObjectPtr old = before.Find(id);
    if (after) {
      changes_.push_back(ObjectPut{layer, std::move(old), after});
    } else if (old) {
      changes_.push_back(ObjectRemoved{layer, std::move(old)});
    }
  }
  if (before.Size() > 0) {
    next_->layers[layer] = before.With(changes);
    return;
  }
  // A layer that was empty is packed at once, which is faster to build and to search.
  std::vector<ObjectPtr> all;
  all.reserve(changes.size());
  for (const auto& [id, object] : changes) {
    if (object) all.push_back(object);
  }
  next_->layers[layer] = std::make_shared<SemanticLayer>(before.spec(), std::move(all));
}

void SnapshotEditor::FinishGrid(const std::string& layer, GridWriter writer) {
  const CellBox extent_before = next_->FindGrid(layer)->extent();
  GridWriter::Result result = std::move(writer).Finish();
  if (result.layer->extent() != extent_before) {
    changes_.push_back(ExtentGrown{layer, result.layer->extent()});
  }
  for (auto& [index, tile] : result.written) {
    changes_.push_back(TileWritten{layer, index, std::move(tile.before), std::move(tile.after)});
  }
  next_->layers[layer] = std::move(result.layer);
}

void SnapshotEditor::FinishTiles(const std::string& layer, const TileMap& tiles) {
  const GridLayer& before = *next_->FindGrid(layer);
  TileMap all = before.tiles();
  for (const auto& [index, tile] : tiles) {
    TilePtr& place = all[index];
    changes_.push_back(TileWritten{layer, index, std::exchange(place, tile), tile});
  }
  next_->layers[layer] = std::make_shared<GridLayer>(before.spec(), before.shared_domain(),
                                                     std::move(all), before.extent());
}

void SnapshotEditor::SetVersions() {
  struct Touch {
    void operator()(const TransformSet& /*change*/) {}
    void operator()(const LayerDeleted& change) { snapshot.layer_versions.erase(change.spec.name); }
    void operator()(const LayerCreated& change) { Set(change.spec.name); }
    void operator()(const AliasesSet& change) { Set(change.layer); }
    void operator()(const ObjectPut& change) { Set(change.layer); }
    void operator()(const ObjectRemoved& change) { Set(change.layer); }
    void operator()(const TileWritten& change) { Set(change.layer); }
    void operator()(const ExtentGrown& change) { Set(change.layer); }
    void Set(const std::string& layer) { snapshot.layer_versions[layer] = snapshot.revision; }

    Snapshot& snapshot;
  } touch{*next_};
  for (const Change& change : changes_) std::visit(touch, change);
}

AppliedBatch SnapshotEditor::Finish() && {
  for (auto& [layer, so_far] : aliases_) FinishAliases(layer, std::move(so_far.aliases));
  for (const auto& [layer, changes] : objects_) FinishObjects(layer, changes);
  for (auto& [layer, writer] : grids_) FinishGrid(layer, std::move(writer));
  for (const auto& [layer, tiles] : tiles_) FinishTiles(layer, tiles);
  SetVersions();
  AppliedBatch applied;
  applied.snapshot = std::move(next_);
  applied.changes = std::move(changes_);
  return applied;
}

}  // namespace hypermap
