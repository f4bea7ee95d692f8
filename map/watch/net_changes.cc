#include "map/watch/net_changes.h"

#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "map/watch/cell_changes.h"

namespace hypermap {

class NetChanges::Adder {
 public:
  explicit Adder(std::map<std::string, LayerChanges>* layers) : layers_(*layers) {}

  void operator()(const LayerCreated& change) { layers_[change.spec.name].created = true; }
  void operator()(const LayerDeleted& change) {
    LayerChanges& layer = layers_[change.spec.name];
    // Content before the deletion belongs to a layer that is gone. A layer that was also created
    // between the revisions leaves no trace.
    LayerChanges gone;
    gone.deleted = layer.deleted || !layer.created;
    layer = std::move(gone);
  }
  void operator()(const ObjectPut& change) { Put(change.layer, change.before, change.after); }
  void operator()(const ObjectRemoved& change) { Put(change.layer, change.before, nullptr); }
  void operator()(const TileWritten& change) {
    layers_[change.layer]
        .tiles.try_emplace(change.index, TileEnds{change.before, nullptr})
        .first->second.after = change.after;
  }
  // Reader finds these by comparing the structures; a layer is only marked as touched.
  void operator()(const TransformSet& /*change*/) {}
  void operator()(const AliasesSet& change) { layers_[change.layer]; }
  void operator()(const ExtentGrown& change) { layers_[change.layer]; }

 private:
  void Put(const std::string& layer, const ObjectPtr& before, const ObjectPtr& after) {
    const ObjectId id = after ? after->id : before->id;
    // The first change of an object has its state before all of them, the last one its state after.
    layers_[layer].objects.try_emplace(id, Ends{before, nullptr}).first->second.after = after;
  }

  std::map<std::string, LayerChanges>& layers_;
};

void NetChanges::Add(const std::vector<Change>& changes) {
  Adder adder(&layers_);
  for (const Change& change : changes) std::visit(adder, change);
}

NetChanges::Reader NetChanges::Read(StructurePtr from, StructurePtr to,
                                    const std::vector<std::string>& layers,
                                    std::string frame_id) && {
  if (!layers.empty()) {
    const absl::flat_hash_set<absl::string_view> wanted(layers.begin(), layers.end());
    std::erase_if(layers_, [&](const auto& layer) { return !wanted.contains(layer.first); });
  }
  return Reader(std::move(from), std::move(to), std::move(frame_id), std::move(layers_));
}

NetChanges::Reader::Reader(StructurePtr from, StructurePtr to, std::string frame_id,
                           std::map<std::string, LayerChanges> layers)
    : from_(std::move(from)),
      to_(std::move(to)),
      frame_id_(std::move(frame_id)),
      layers_(std::move(layers)) {
  for (FrameTransform& transform : to_->frames.transforms()) {
    const FrameTransform* const before = from_->frames.Find(transform.child_frame_id);
    if (before == nullptr || !(*before == transform)) transforms_.push_back(std::move(transform));
  }
}

absl::StatusOr<std::optional<MapChange>> NetChanges::Reader::Next() {
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  ++looks_;
  if (next_transform_ < transforms_.size()) {
    MapChange told;
    told.kind = ChangeKind::kTransform;
    told.transform = std::move(transforms_[next_transform_++]);
    return told;
  }
  LayerChanges& layer = layers_.begin()->second;
  if (std::exchange(layer.deleted, false)) return Make(ChangeKind::kLayerDeleted);
  if (!std::exchange(in_layer_, true)) return BeginLayer();
  if (!layer.objects.empty()) return CompareObject();
  if (!layer.tiles.empty()) return CompareTile();
  layers_.erase(layers_.begin());
  in_layer_ = false;
  return std::nullopt;
}

MapChange NetChanges::Reader::Make(ChangeKind kind) const {
  MapChange told;
  told.kind = kind;
  told.layer = layers_.begin()->first;
  return told;
}

std::optional<MapChange> NetChanges::Reader::BeginLayer() {
  auto& [name, changes] = *layers_.begin();
  layer_ = to_->FindLayer(name);
  const auto transform =
      layer_ ? to_->frames.Lookup(frame_id_, layer_->spec.frame_id) : absl::NotFoundError(name);
  // Content without a place in the caller's frame is left out.
  if (!transform.ok()) changes.objects.clear();
  domain_ = transform.ok() ? MakeCellDomain(layer_->spec) : nullptr;
  if (!domain_) changes.tiles.clear();
  if (!layer_) return std::nullopt;
  caller_from_layer_ = transform.value_or(PlanarTransform());
  const LayerStructure* const before = from_->FindLayer(name);
  const bool is_same = before && before->spec == layer_->spec && before->extent == layer_->extent;
  if (is_same && !changes.created) return std::nullopt;
  MapChange told = Make(changes.created ? ChangeKind::kLayerCreated : ChangeKind::kLayerChanged);
  told.layer_now = *layer_;
  return told;
}

std::optional<MapChange> NetChanges::Reader::CompareObject() {
  auto& objects = layers_.begin()->second.objects;
  const auto node = objects.extract(objects.begin());
  const auto& [before, after] = node.mapped();
  if (!before && !after) return std::nullopt;
  if (before && after && *before == *after) return std::nullopt;
  MapChange told = Make(after ? ChangeKind::kPut : ChangeKind::kRemove);
  told.caller_from_layer = caller_from_layer_;
  told.object_id = node.key();
  told.object = after;
  told.object_before = before;
  return told;
}

std::optional<MapChange> NetChanges::Reader::CompareTile() {
  auto& tiles = layers_.begin()->second.tiles;
  const auto node = tiles.extract(tiles.begin());
  looks_ += kTileSide;
  CellChanges cells =
      ChangedCells(node.key(), node.mapped().before.get(), node.mapped().after.get(), *domain_);
  if (cells.after.empty()) return std::nullopt;
  MapChange told = Make(ChangeKind::kCells);
  told.caller_from_layer = caller_from_layer_;
  told.grid = layer_->spec.grid;
  told.cells = std::move(cells.after);
  told.cells_before = std::move(cells.before);
  return told;
}

}  // namespace hypermap
