#include "map/edits/difference.h"

#include <memory>
#include <string>
#include <utility>

#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {
namespace {

// Returns whether changes of content and aliases can turn the layer of `before` into that of
// `after`.
bool IsSameLayer(const Snapshot& before, const Snapshot& after, const std::string& name) {
  const Layer* was = before.FindLayer(name);
  const Layer* is = after.FindLayer(name);
  if (!was || !is || before.LayerVersionOf(name) > after.LayerVersionOf(name)) return false;
  LayerSpec spec = is->spec();
  spec.aliases = was->spec().aliases;
  return spec == was->spec();
}

bool IsSameObject(const ObjectPtr& a, const ObjectPtr& b) {
  return a == b || (a->version == b->version && *a == *b);
}

// Adds the changes of a layer that is in both snapshots.
class LayerDifference {
 public:
  LayerDifference(const std::string& name, std::vector<Change>* changes)
      : name_(name), changes_(*changes) {}

  void Add(const Layer& before, const Layer& after) {
    if (&before == &after) return;
    if (before.spec().aliases != after.spec().aliases) {
      changes_.push_back(ChangeOfAliases(name_, before.spec().aliases, after.spec().aliases));
    }
    if (const auto* grid = AsGrid(&after)) {
      AddCells(*AsGrid(&before), *grid);
    } else {
      AddObjects(AsSemantic(&before)->Objects(), AsSemantic(&after)->Objects());
    }
  }

  // Adds a change without an effect other than setting the layer's version.
  void Touch(const Layer& layer) {
    if (const auto* grid = AsGrid(&layer)) {
      changes_.push_back(ExtentGrown{name_, grid->extent()});
    } else {
      changes_.push_back(AliasesSet{name_, {}, {}});
    }
  }

 private:
  // Both are sorted by id.
  void AddObjects(const std::vector<ObjectPtr>& before, const std::vector<ObjectPtr>& after) {
    auto was = before.begin();
    for (const ObjectPtr& object : after) {
      for (; was != before.end() && (*was)->id < object->id; ++was) {
        changes_.push_back(ObjectRemoved{name_, *was});
      }
      if (was == before.end() || (*was)->id > object->id) {
        changes_.push_back(ObjectPut{name_, nullptr, object});
        continue;
      }
      if (!IsSameObject(*was, object)) changes_.push_back(ObjectPut{name_, *was, object});
      ++was;
    }
    for (; was != before.end(); ++was) changes_.push_back(ObjectRemoved{name_, *was});
  }

  void AddCells(const GridLayer& before, const GridLayer& after) {
    if (before.extent() != after.extent()) {
      changes_.push_back(ExtentGrown{name_, after.extent()});
    }
    for (const auto& [index, tile] : after.tiles()) {
      const auto was = before.tiles().find(index);
      const TilePtr old = was == before.tiles().end() ? nullptr : was->second;
      AddTile(index, old, tile);
    }
    for (const auto& [index, tile] : before.tiles()) {
      if (!after.tiles().contains(index)) AddTile(index, tile, EmptyTile());
    }
  }

  void AddTile(const TileIndex& index, const TilePtr& before, const TilePtr& after) {
    if (before == after) return;
    if (before && before->Holds(after->codes())) return;
    changes_.push_back(TileWritten{name_, index, before, after});
  }

  static TilePtr EmptyTile() {
    auto codes = std::make_unique<TileCodes>();
    codes->fill(kUnknownCode);
    return Tile::Make(*codes);
  }

  const std::string& name_;
  std::vector<Change>& changes_;
};

void AddTransforms(const FrameTree& before, const FrameTree& after, std::vector<Change>* changes) {
  for (FrameTransform& transform : after.transforms()) {
    const FrameTransform* const known = before.Find(transform.child_frame_id);
    if (known != nullptr && *known == transform) continue;
    changes->push_back(TransformSet{std::move(transform)});
  }
}

}  // namespace

std::vector<Change> Difference(const Snapshot& before, const Snapshot& after) {
  std::vector<Change> changes;
  for (const auto& [name, layer] : before.layers) {
    if (!IsSameLayer(before, after, name)) changes.push_back(LayerDeleted{layer->spec()});
  }
  AddTransforms(before.frames, after.frames, &changes);
  for (const auto& [name, layer] : after.layers) {
    LayerDifference difference(name, &changes);
    if (!IsSameLayer(before, after, name)) {
      changes.push_back(LayerCreated{layer->spec()});
      difference.Add(*MakeEmptyLayer(layer->spec()), *layer);
      continue;
    }
    const size_t num_before = changes.size();
    difference.Add(*before.FindLayer(name), *layer);
    const bool has_changed = before.LayerVersionOf(name) != after.LayerVersionOf(name);
    if (has_changed && changes.size() == num_before) difference.Touch(*layer);
  }
  return changes;
}

}  // namespace hypermap
