#include "map/watch/net_changes.h"

#include <algorithm>
#include <utility>

#include "map/layers/grid_layer.h"
#include "map/watch/cell_changes.h"

namespace hypermap {

class NetChanges::Adder {
 public:
  explicit Adder(std::map<std::string, LayerChanges>* layers) : layers_(*layers) {}

  void operator()(const LayerCreated& change) { layers_[change.spec.name].created = true; }
  void operator()(const LayerDeleted& change) {
    LayerChanges& layer = layers_[change.spec.name];
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
  // Seen by comparing the structures.
  void operator()(const TransformSet& /*change*/) {}
  void operator()(const AliasesSet& change) { layers_[change.layer]; }
  void operator()(const ExtentGrown& change) { layers_[change.layer]; }

 private:
  void Put(const std::string& layer, const ObjectPtr& before, const ObjectPtr& after) {
    const ObjectId id = after ? after->id : before->id;
    layers_[layer].objects.try_emplace(id, Ends{before, nullptr}).first->second.after = after;
  }

  std::map<std::string, LayerChanges>& layers_;
};

class NetChanges::Teller {
 public:
  Teller(const Snapshot& from, const Snapshot& to, const std::string& frame_id)
      : from_(from), to_(to), frame_id_(frame_id) {}

  void TellTransforms() {
    const std::vector<FrameTransform> before = from_.frames.transforms();
    for (const FrameTransform& transform : to_.frames.transforms()) {
      if (std::find(before.begin(), before.end(), transform) != before.end()) continue;
      ToldChange told;
      told.kind = ChangeKind::kTransform;
      told.transform = transform;
      told_.push_back(std::move(told));
    }
  }

  void TellLayer(const std::string& name, const LayerChanges& changes) {
    if (changes.deleted) Add(ChangeKind::kLayerDeleted, name);
    const auto layer = to_.layers.find(name);
    if (layer == to_.layers.end()) return;
    if (changes.created) {
      AddLayer(ChangeKind::kLayerCreated, layer->second);
    } else if (!SameStructure(from_.FindLayer(name), *layer->second)) {
      AddLayer(ChangeKind::kLayerChanged, layer->second);
    }
    const auto transform = to_.frames.Lookup(frame_id_, layer->second->spec().frame_id);
    if (!transform.ok()) return;
    const size_t first = told_.size();
    for (const auto& [id, ends] : changes.objects) TellObject(name, id, ends);
    if (const auto* grid = AsGrid(layer->second.get())) {
      for (const auto& [index, ends] : changes.tiles) TellTile(*grid, index, ends);
    }
    for (size_t i = first; i < told_.size(); ++i) told_[i].caller_from_layer = *transform;
  }

  std::vector<ToldChange> Take() && { return std::move(told_); }

 private:
  static bool SameStructure(const Layer* before, const Layer& after) {
    return before && before->spec() == after.spec() && before->Bounds() == after.Bounds();
  }

  ToldChange& Add(ChangeKind kind, const std::string& layer) {
    ToldChange& told = told_.emplace_back();
    told.kind = kind;
    told.layer = layer;
    return told;
  }

  void AddLayer(ChangeKind kind, const LayerPtr& layer) {
    ToldChange& told = Add(kind, layer->spec().name);
    told.layer_now = layer;
    told.layer_version = to_.LayerVersionOf(layer->spec().name);
  }

  void TellObject(const std::string& layer, ObjectId id, const Ends& ends) {
    if (!ends.before && !ends.after) return;
    if (ends.before && ends.after && *ends.before == *ends.after) return;
    ToldChange& told = Add(ends.after ? ChangeKind::kPut : ChangeKind::kRemove, layer);
    told.object_id = id;
    told.object = ends.after;
    told.object_before = ends.before;
  }

  void TellTile(const GridLayer& grid, const TileIndex& index, const TileEnds& ends) {
    CellChanges cells =
        ChangedCells(index, ends.before.get(), ends.after.get(), grid.domain(), nullptr);
    if (cells.after.empty()) return;
    ToldChange& told = Add(ChangeKind::kCells, grid.spec().name);
    told.grid = grid.geometry();
    told.cells = std::move(cells.after);
    told.cells_before = std::move(cells.before);
  }

  const Snapshot& from_;
  const Snapshot& to_;
  const std::string& frame_id_;
  std::vector<ToldChange> told_;
};

void NetChanges::Add(const std::vector<Change>& changes) {
  Adder adder(&layers_);
  for (const Change& change : changes) std::visit(adder, change);
}

std::vector<ToldChange> NetChanges::Finish(const Snapshot& from, const Snapshot& to,
                                           const std::vector<std::string>& layers,
                                           const std::string& frame_id) && {
  Teller teller(from, to, frame_id);
  teller.TellTransforms();
  for (const auto& [name, changes] : layers_) {
    const bool wanted =
        layers.empty() || std::find(layers.begin(), layers.end(), name) != layers.end();
    if (wanted) teller.TellLayer(name, changes);
  }
  return std::move(teller).Take();
}

}  // namespace hypermap
