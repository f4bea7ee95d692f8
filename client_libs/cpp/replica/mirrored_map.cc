#include "client_libs/cpp/replica/mirrored_map.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/strings/str_cat.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::client {
namespace {

absl::Status Misfit(absl::string_view what, absl::string_view layer) {
  return absl::InternalError(
      absl::StrCat("the server's answer: ", what, " of layer \"", layer, "\", which is not so"));
}

// Carries out the changes of one event on a copy. Content is collected per layer, and put into the
// layer when all of the event's has come or before the layer itself changes.
class EventEditor {
 public:
  explicit EventEditor(Snapshot before) : next_(std::make_shared<Snapshot>(std::move(before))) {}

  absl::Status Carry(const MapChange& change);
  // The map at the event's revision.
  SnapshotPtr Finish(const WatchEvent& event) &&;

 private:
  using Objects = absl::btree_map<ObjectId, ObjectPtr>;  // null: gone

  absl::Status CreateLayer(const MapChange& change);
  absl::Status ChangeLayer(const MapChange& change);
  absl::Status DeleteLayer(const std::string& name);
  absl::Status PutObject(const MapChange& change);
  absl::Status WriteCells(const MapChange& change);
  // Puts what was collected of a layer into it.
  void Settle(const std::string& name);
  // Null when there is none of this kind.
  template <typename Kind>
  std::shared_ptr<const Kind> Find(const std::string& name) const {
    const auto layer = next_->layers.find(name);
    if (layer == next_->layers.end()) return nullptr;
    if constexpr (std::is_same_v<Kind, GridLayer>) {
      return AsGrid(layer->second);
    } else {
      return AsSemantic(layer->second);
    }
  }

  std::shared_ptr<Snapshot> next_;
  std::map<std::string, Objects> objects_;
  std::map<std::string, GridWriter> cells_;
  std::vector<std::string> touched_;  // layers whose content changed
};

absl::Status EventEditor::Carry(const MapChange& change) {
  switch (change.kind) {
    case ChangeKind::kPut:
    case ChangeKind::kEnter:
    case ChangeKind::kRemove:
    case ChangeKind::kLeave:
      return PutObject(change);
    case ChangeKind::kCells:
      return WriteCells(change);
    case ChangeKind::kLayerCreated:
      return CreateLayer(change);
    case ChangeKind::kLayerDeleted:
      return DeleteLayer(change.layer);
    case ChangeKind::kLayerChanged:
      return ChangeLayer(change);
    case ChangeKind::kTransform:
      if (!change.transform) return Misfit("a transform", change.layer);
      return next_->frames.Set(*change.transform);
  }
  return absl::OkStatus();
}

absl::Status EventEditor::CreateLayer(const MapChange& change) {
  if (!change.layer_now) return Misfit("the creation", change.layer);
  const LayerSpec& spec = change.layer_now->spec;
  LayerPtr layer = MakeEmptyLayer(spec);
  if (const auto* grid = AsGrid(layer.get())) {
    layer = std::make_shared<GridLayer>(spec, grid->shared_domain(), TileMap(),
                                        change.layer_now->extent.value_or(CellBox()));
  }
  next_->layers[spec.name] = std::move(layer);
  next_->layer_versions[spec.name] = change.layer_now->version;
  return absl::OkStatus();
}

absl::Status EventEditor::ChangeLayer(const MapChange& change) {
  Settle(change.layer);
  if (!change.layer_now) return Misfit("a change", change.layer);
  if (const auto grid = Find<GridLayer>(change.layer)) {
    next_->layers[change.layer] =
        std::make_shared<GridLayer>(grid->spec(), grid->shared_domain(), grid->tiles(),
                                    change.layer_now->extent.value_or(grid->extent()));
  } else if (const auto semantic = Find<SemanticLayer>(change.layer)) {
    next_->layers[change.layer] = semantic->WithAliases(change.layer_now->spec.aliases);
  } else {
    return Misfit("a change", change.layer);
  }
  touched_.push_back(change.layer);
  return absl::OkStatus();
}

absl::Status EventEditor::DeleteLayer(const std::string& name) {
  objects_.erase(name);
  cells_.erase(name);
  std::erase(touched_, name);
  next_->layers.erase(name);
  next_->layer_versions.erase(name);
  return absl::OkStatus();
}

absl::Status EventEditor::PutObject(const MapChange& change) {
  auto objects = objects_.find(change.layer);
  if (objects == objects_.end()) {
    if (!Find<SemanticLayer>(change.layer)) return Misfit("an object", change.layer);
    objects = objects_.emplace(change.layer, Objects()).first;
  }
  const bool is_there = change.kind == ChangeKind::kPut || change.kind == ChangeKind::kEnter;
  if (is_there != change.object.has_value()) return Misfit("an object", change.layer);
  ObjectPtr object;
  if (is_there) object = std::make_shared<SemanticObject>(*change.object);
  objects->second[change.object_id] = std::move(object);
  next_->next_object_id = std::max(next_->next_object_id, change.object_id + 1);
  return absl::OkStatus();
}

absl::Status EventEditor::WriteCells(const MapChange& change) {
  auto writer = cells_.find(change.layer);
  if (writer == cells_.end()) {
    auto grid = Find<GridLayer>(change.layer);
    if (!grid) return Misfit("cells", change.layer);
    writer = cells_.emplace(change.layer, GridWriter(std::move(grid))).first;
  }
  for (const CellRun& run : change.cells) {
    const CellBox box{run.row, run.row + 1, run.col_begin, run.col_end};
    const std::vector<std::optional<double>> values(std::max<int64_t>(box.cols(), 0), run.value);
    if (absl::Status status = writer->second.Write(box, values); !status.ok()) {
      return absl::InternalError(absl::StrCat("the server's answer: ", status.message()));
    }
  }
  return absl::OkStatus();
}

void EventEditor::Settle(const std::string& name) {
  if (auto writer = cells_.extract(name)) {
    next_->layers[name] = std::move(writer.mapped()).Finish().layer;
    touched_.push_back(name);
  }
  auto objects = objects_.extract(name);
  if (!objects) return;
  touched_.push_back(name);
  const auto layer = Find<SemanticLayer>(name);
  if (layer->Size() > 0) {
    next_->layers[name] = layer->With(objects.mapped());
    return;
  }
  std::vector<ObjectPtr> all;
  for (auto& [id, object] : objects.mapped()) {
    if (object) all.push_back(std::move(object));
  }
  next_->layers[name] = std::make_shared<SemanticLayer>(layer->spec(), std::move(all));
}

SnapshotPtr EventEditor::Finish(const WatchEvent& event) && {
  while (!objects_.empty()) Settle(objects_.begin()->first);
  while (!cells_.empty()) Settle(cells_.begin()->first);
  next_->revision = event.revision;
  // A snapshot tells the versions itself.
  if (!event.snapshot) {
    for (const std::string& name : touched_) next_->layer_versions[name] = event.revision;
  }
  return std::move(next_);
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
  EventEditor editor(std::move(start));
  for (const MapChange& change : event.changes) {
    if (absl::Status status = editor.Carry(change); !status.ok()) return status;
  }
  return std::move(editor).Finish(event);
}

}  // namespace hypermap::client
