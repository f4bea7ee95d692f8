#include "map/watch/structure.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {
namespace {

LayerPtr EmptyGrid(const GridLayer& grid, const CellBox& extent) {
  return std::make_shared<GridLayer>(grid.spec(), grid.shared_domain(), TileMap(), extent);
}

// The layer without content.
LayerPtr EmptyLike(const Layer& layer) {
  if (const auto* grid = AsGrid(&layer)) {
    return EmptyGrid(*grid, grid->extent());
  }
  return MakeEmptyLayer(layer.spec());
}

// Carries the changes of structure out on a copy.
class StructureEditor {
 public:
  explicit StructureEditor(const SnapshotPtr& before) : before_(before) {}

  template <typename ContentChange>
  void operator()(const ContentChange& /*change*/) {}
  void operator()(const LayerCreated& change) {
    Next().layers[change.spec.name] = MakeEmptyLayer(change.spec);
  }
  void operator()(const LayerDeleted& change) { Next().layers.erase(change.spec.name); }
  void operator()(const TransformSet& change) {
    // It was carried out before, so it fits.
    Next().frames.Set(change.transform).IgnoreError();
  }
  void operator()(const ExtentGrown& change) {
    const auto* grid = Next().FindGrid(change.layer);
    if (grid) next_->layers[change.layer] = EmptyGrid(*grid, change.extent);
  }
  void operator()(const AliasesSet& change) {
    const Layer* layer = Next().FindLayer(change.layer);
    if (!layer) return;
    LayerSpec spec = layer->spec();
    spec.aliases = change.after;
    next_->layers[change.layer] = MakeEmptyLayer(std::move(spec));
  }

  SnapshotPtr Finish(Revision revision) && {
    if (!next_) return before_;
    next_->revision = revision;
    return std::move(next_);
  }

 private:
  Snapshot& Next() {
    if (!next_) next_ = std::make_shared<Snapshot>(*before_);
    return *next_;
  }

  const SnapshotPtr& before_;
  std::shared_ptr<Snapshot> next_;
};

}  // namespace

SnapshotPtr StructureOf(const Snapshot& snapshot) {
  auto structure = std::make_shared<Snapshot>(snapshot);
  for (auto& [name, layer] : structure->layers) layer = EmptyLike(*layer);
  return structure;
}

SnapshotPtr StructureAfter(const SnapshotPtr& before, Revision revision,
                           const std::vector<Change>& changes) {
  StructureEditor editor(before);
  for (const Change& change : changes) std::visit(editor, change);
  return std::move(editor).Finish(revision);
}

}  // namespace hypermap
