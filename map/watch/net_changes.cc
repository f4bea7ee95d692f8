#include "map/watch/net_changes.h"

#include <algorithm>
#include <utility>

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
  // Finish finds these by comparing the structures; a layer is only marked as touched.
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

class NetChanges::DifferenceBuilder {
 public:
  DifferenceBuilder(const MapStructure& from, const MapStructure& to, const std::string& frame_id)
      : from_(from), to_(to), frame_id_(frame_id) {}

  void TellTransforms() {
    for (const FrameTransform& transform : to_.frames.transforms()) {
      const FrameTransform* const before = from_.frames.Find(transform.child_frame_id);
      if (before != nullptr && *before == transform) continue;
      MapChange told;
      told.kind = ChangeKind::kTransform;
      told.transform = transform;
      told_.push_back(std::move(told));
    }
  }

  void TellLayer(const std::string& name, const LayerChanges& changes) {
    if (changes.deleted) Add(ChangeKind::kLayerDeleted, name);
    const LayerStructure* layer = to_.FindLayer(name);
    if (!layer) return;
    if (changes.created) {
      AddLayer(ChangeKind::kLayerCreated, *layer);
    } else if (!SameStructure(from_.FindLayer(name), *layer)) {
      AddLayer(ChangeKind::kLayerChanged, *layer);
    }
    const auto transform = to_.frames.Lookup(frame_id_, layer->spec.frame_id);
    // Content without a place in the caller's frame is left out.
    if (!transform.ok()) return;
    const size_t first = told_.size();
    for (const auto& [id, ends] : changes.objects) TellObject(name, id, ends);
    if (const auto domain = MakeCellDomain(layer->spec)) {
      for (const auto& [index, ends] : changes.tiles) {
        TellTile(layer->spec, *domain, index, ends);
      }
    }
    for (size_t i = first; i < told_.size(); ++i) told_[i].caller_from_layer = *transform;
  }

  std::vector<MapChange> Take() && { return std::move(told_); }

 private:
  static bool SameStructure(const LayerStructure* before, const LayerStructure& after) {
    return before && before->spec == after.spec && before->extent == after.extent;
  }

  MapChange& Add(ChangeKind kind, const std::string& layer) {
    MapChange& told = told_.emplace_back();
    told.kind = kind;
    told.layer = layer;
    return told;
  }

  void AddLayer(ChangeKind kind, const LayerStructure& layer) {
    Add(kind, layer.spec.name).layer_now = layer;
  }

  void TellObject(const std::string& layer, ObjectId id, const Ends& ends) {
    if (!ends.before && !ends.after) return;
    if (ends.before && ends.after && *ends.before == *ends.after) return;
    MapChange& told = Add(ends.after ? ChangeKind::kPut : ChangeKind::kRemove, layer);
    told.object_id = id;
    told.object = ends.after;
    told.object_before = ends.before;
  }

  void TellTile(const LayerSpec& spec, const CellDomain& domain, const TileIndex& index,
                const TileEnds& ends) {
    CellChanges cells = ChangedCells(index, ends.before.get(), ends.after.get(), domain, nullptr);
    if (cells.after.empty()) return;
    MapChange& told = Add(ChangeKind::kCells, spec.name);
    told.grid = spec.grid;
    told.cells = std::move(cells.after);
    told.cells_before = std::move(cells.before);
  }

  const MapStructure& from_;
  const MapStructure& to_;
  const std::string& frame_id_;
  std::vector<MapChange> told_;
};

void NetChanges::Add(const std::vector<Change>& changes) {
  Adder adder(&layers_);
  for (const Change& change : changes) std::visit(adder, change);
}

std::vector<MapChange> NetChanges::Finish(const MapStructure& from, const MapStructure& to,
                                          const std::vector<std::string>& layers,
                                          const std::string& frame_id) && {
  DifferenceBuilder builder(from, to, frame_id);
  builder.TellTransforms();
  for (const auto& [name, changes] : layers_) {
    const bool wanted =
        layers.empty() || std::find(layers.begin(), layers.end(), name) != layers.end();
    if (wanted) builder.TellLayer(name, changes);
  }
  return std::move(builder).Take();
}

}  // namespace hypermap
