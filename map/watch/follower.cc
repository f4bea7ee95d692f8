#include "map/watch/follower.h"

#include <algorithm>
#include <utility>

#include "base/status/status_macros.h"
#include "map/geometry/predicates.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "map/query/query.h"
#include "map/values/value_aliases.h"
#include "map/values/value_query.h"
#include "map/watch/cell_changes.h"

namespace hypermap {
namespace {

// Returns the labels that the folded classes stand for in a layer.
std::set<std::string> LabelsOf(const ValueAliases& aliases, const std::set<std::string>& classes) {
  std::set<std::string> labels;
  for (const std::string& word : classes) labels.merge(LabelsFor(aliases, word));
  return labels;
}

// Returns a rectangle in the caller's frame that covers all content of the layers; ContentIn needs
// an area.
Polygon Everywhere(const Snapshot& snapshot, const std::string& frame_id,
                   const std::vector<std::string>& layers) {
  Box box;
  for (const std::string& name : layers) {
    const Layer& layer = *snapshot.FindLayer(name);
    const auto transform = snapshot.frames.Lookup(frame_id, layer.spec().frame_id);
    const Box bounds = layer.Bounds();
    if (!transform.ok() || bounds.empty()) continue;
    for (const double x : {bounds.min.x, bounds.max.x}) {
      for (const double y : {bounds.min.y, bounds.max.y}) box.Extend(*transform * Point{x, y});
    }
  }
  if (box.empty()) box.Extend(Point{0.0, 0.0});
  // The margin exceeds the rounding errors of the transforms.
  const double margin = 1.0 + 1e-9 * std::max({std::abs(box.min.x), std::abs(box.min.y),
                                               std::abs(box.max.x), std::abs(box.max.y)});
  return Polygon::FromBox(
      {{box.min.x - margin, box.min.y - margin}, {box.max.x + margin, box.max.y + margin}});
}

class ContentReader : public SelectionReader {
 public:
  ContentReader(std::unique_ptr<PartReader> parts, std::set<std::string> classes)
      : parts_(std::move(parts)), classes_(std::move(classes)) {}

  std::vector<MapChange> Next(int max_items) override {
    std::vector<MapChange> told;
    if (done()) return told;
    LayerPart part = parts_->Next(max_items);
    if (part.status != AnswerStatus::kValue) return told;
    const LayerSpec& spec = part.layer->spec();
    MapChange change;
    change.layer = spec.name;
    change.caller_from_layer = part.caller_from_layer;
    const std::set<std::string> labels = LabelsOf(spec.aliases, classes_);
    for (ObjectPtr& object : part.part.objects) {
      if (!classes_.empty() && !labels.contains(FoldLabel(object->label))) continue;
      change.object_id = object->id;
      change.object = std::move(object);
      told.push_back(change);
    }
    // A subscriber begins without cells, so that unknown ones need not be sent.
    std::erase_if(part.part.runs, [](const CellRun& run) { return !run.value; });
    if (part.part.runs.empty()) return told;
    change.kind = ChangeKind::kCells;
    change.grid = spec.grid;
    change.cells = std::move(part.part.runs);
    told.push_back(std::move(change));
    return told;
  }

  bool done() const override { return !parts_ || parts_->done(); }

 private:
  std::unique_ptr<PartReader> parts_;  // Null: nothing to read.
  std::set<std::string> classes_;
};

}  // namespace

// A layer of the structure, with the filter converted to the layer's terms: its area in the layer's
// frame, its classes as labels.
class Follower::FollowedLayer {
 public:
  FollowedLayer(const Follower& follower, const MapStructure& structure, LayerStructure layer)
      : layer_(std::move(layer)),
        domain_(MakeCellDomain(layer_.spec)),
        all_classes_(follower.classes_.empty()) {
    const LayerSpec& spec = layer_.spec;
    labels_ = LabelsOf(spec.aliases, follower.classes_);
    const WatchFilter& filter = follower.filter_;
    const auto transform = structure.frames.Lookup(follower.frame_id_, spec.frame_id);
    connected_ = transform.ok() || (follower.as_stored() && !filter.area);
    if (!connected_) return;
    if (!follower.as_stored()) caller_from_layer_ = *transform;
    if (!filter.area) return;
    const Polygon area = transform->Inverse() * *filter.area;
    bounds_ = area.bounds();
    area_.emplace(area);
    const CellRule rule = follower.as_stored() ? CellRule::kTouched : CellRule::kCentre;
    if (spec.grid) cover_.emplace(area, *spec.grid, kAllCells, rule);
  }

  const LayerStructure& layer() const { return layer_; }
  const LayerSpec& spec() const { return layer_.spec; }
  // Null if the layer is not a grid.
  const CellDomain* domain() const { return domain_.get(); }
  bool connected() const { return connected_; }
  const PlanarTransform& caller_from_layer() const { return caller_from_layer_; }
  const CellCover* cover() const { return cover_ ? &*cover_ : nullptr; }

  bool Selects(const ObjectPtr& object) const {
    if (!object || !connected_) return false;
    if (!all_classes_ && !labels_.contains(FoldLabel(object->label))) return false;
    return !area_ ||
           (object->shape.bounds().Intersects(bounds_) && area_->Intersects(object->shape));
  }

 private:
  LayerStructure layer_;
  std::shared_ptr<const CellDomain> domain_;
  bool all_classes_;
  std::set<std::string> labels_;
  bool connected_ = false;
  PlanarTransform caller_from_layer_;
  Box bounds_;
  std::optional<PreparedPolygon> area_;  // In the layer's frame.
  std::optional<CellCover> cover_;       // Set for a grid with an area.
};

// Converts the changes of a commit for the subscriber. The follower must have moved to the
// structure after the commit.
class Follower::ChangeSelector {
 public:
  explicit ChangeSelector(const Follower& follower) : follower_(follower) {}

  void operator()(const LayerCreated& change) {
    if (follower_.Follows(change.spec.name)) {
      AddLayer(ChangeKind::kLayerCreated, change.spec.name);
    }
  }
  void operator()(const LayerDeleted& change) {
    if (!follower_.Follows(change.spec.name)) return;
    MapChange told;
    told.kind = ChangeKind::kLayerDeleted;
    told.layer = change.spec.name;
    told_.push_back(std::move(told));
  }
  void operator()(const AliasesSet& change) { AddLayer(ChangeKind::kLayerChanged, change.layer); }
  void operator()(const ExtentGrown& change) { AddLayer(ChangeKind::kLayerChanged, change.layer); }
  void operator()(const TransformSet& change) {
    MapChange told;
    told.kind = ChangeKind::kTransform;
    told.transform = change.transform;
    told_.push_back(std::move(told));
  }
  void operator()(const ObjectPut& change) {
    const FollowedLayer* layer = Find(change.layer);
    if (!layer) return;
    // The filter of one structure judges both versions of the object: NeedsReset has ruled out that
    // the commit changed the meaning of the filter.
    const bool was = layer->Selects(change.before);
    const bool is = layer->Selects(change.after);
    if (!was && !is) return;
    const bool crossed = change.before && was != is;
    const ChangeKind kind =
        !crossed ? ChangeKind::kPut : (is ? ChangeKind::kEnter : ChangeKind::kLeave);
    AddObject(kind, *layer, change.after->id, is ? change.after : nullptr);
  }
  void operator()(const ObjectRemoved& change) {
    const FollowedLayer* layer = Find(change.layer);
    if (layer && layer->Selects(change.before)) {
      AddObject(ChangeKind::kRemove, *layer, change.before->id, nullptr);
    }
  }
  void operator()(const TileWritten& change) {
    const FollowedLayer* layer = Find(change.layer);
    if (!layer || !layer->connected()) return;
    if (!layer->domain()) return;
    // Testing the tile against the bounds is much cheaper than comparing its cells.
    if (layer->cover() && layer->cover()->bounds().Intersection(CellsOf(change.index)).empty()) {
      return;
    }
    CellChanges cells = ChangedCells(change.index, change.before.get(), change.after.get(),
                                     *layer->domain(), layer->cover());
    if (cells.after.empty()) return;
    MapChange told;
    told.kind = ChangeKind::kCells;
    told.layer = change.layer;
    told.caller_from_layer = layer->caller_from_layer();
    told.grid = layer->spec().grid;
    told.cells = std::move(cells.after);
    told_.push_back(std::move(told));
  }

  std::vector<MapChange> Take() && { return std::move(told_); }

 private:
  const FollowedLayer* Find(const std::string& name) const {
    const auto layer = follower_.layers_.find(name);
    return layer == follower_.layers_.end() ? nullptr : layer->second.get();
  }

  void AddLayer(ChangeKind kind, const std::string& name) {
    const FollowedLayer* layer = Find(name);
    if (!layer) return;  // Not followed, or deleted in the same commit.
    MapChange told;
    told.kind = kind;
    told.layer = name;
    told.caller_from_layer = layer->caller_from_layer();
    told.layer_now = layer->layer();
    told_.push_back(std::move(told));
  }

  void AddObject(ChangeKind kind, const FollowedLayer& layer, ObjectId id, ObjectPtr object) {
    MapChange told;
    told.kind = kind;
    told.layer = layer.spec().name;
    told.caller_from_layer = layer.caller_from_layer();
    told.object_id = id;
    told.object = std::move(object);
    told_.push_back(std::move(told));
  }

  const Follower& follower_;
  std::vector<MapChange> told_;
};

// Reads a snapshot as stored: transforms, then the layers by name, each before its content.
class Follower::StoredReader : public SelectionReader {
 public:
  StoredReader(SnapshotPtr snapshot, std::vector<std::shared_ptr<const FollowedLayer>> layers)
      : snapshot_(std::move(snapshot)), layers_(std::move(layers)) {}

  std::vector<MapChange> Next(int max_items) override {
    std::vector<MapChange> told;
    if (!std::exchange(begun_, true)) TellTransforms(&told);
    if (done()) return told;
    const FollowedLayer& followed = *layers_[current_];
    const Layer& layer = *snapshot_->FindLayer(followed.spec().name);
    if (!std::exchange(in_layer_, true)) BeginLayer(layer, &told);
    const auto* grid = AsGrid(&layer);
    if (!grid) {
      TellObjects(followed, max_items, &told);
    } else if (followed.connected()) {
      TellTiles(*grid, followed.cover(), max_items, &told);
    } else {
      next_tile_.reset();
    }
    if (next_object_ < objects_.size() || next_tile_) return told;
    in_layer_ = false;
    ++current_;
    return told;
  }

  bool done() const override { return begun_ && current_ == layers_.size(); }

 private:
  static MapChange& Add(ChangeKind kind, std::vector<MapChange>* told) {
    told->emplace_back().kind = kind;
    return told->back();
  }

  void TellTransforms(std::vector<MapChange>* told) const {
    for (FrameTransform& transform : snapshot_->frames.transforms()) {
      Add(ChangeKind::kTransform, told).transform = std::move(transform);
    }
  }

  void BeginLayer(const Layer& layer, std::vector<MapChange>* told) {
    MapChange& created = Add(ChangeKind::kLayerCreated, told);
    created.layer = layer.spec().name;
    const auto* grid = AsGrid(&layer);
    created.layer_now = LayerStructure{layer.spec(), grid ? grid->extent() : CellBox(),
                                       snapshot_->LayerVersionOf(created.layer)};
    objects_.clear();
    next_object_ = 0;
    next_tile_.reset();
    if (const auto* semantic = AsSemantic(&layer)) {
      objects_ = semantic->Objects();
    } else if (!grid->tiles().empty()) {
      next_tile_ = grid->tiles().begin();
    }
  }

  void TellObjects(const FollowedLayer& followed, int max_items, std::vector<MapChange>* told) {
    const size_t end = std::min(objects_.size(), next_object_ + std::max(max_items, 1));
    for (; next_object_ < end; ++next_object_) {
      ObjectPtr& object = objects_[next_object_];
      if (!followed.Selects(object)) continue;
      MapChange& put = Add(ChangeKind::kPut, told);
      put.layer = followed.spec().name;
      put.object_id = object->id;
      put.object = std::move(object);
    }
  }

  // Tiles are not split, so that a part may exceed `max_items` by the runs of one tile.
  void TellTiles(const GridLayer& grid, const CellCover* cover, int max_items,
                 std::vector<MapChange>* told) {
    int64_t runs = 0;
    for (; next_tile_ && runs < max_items;) {
      const auto& [index, tile] = **next_tile_;
      CellChanges cells = ChangedCells(index, nullptr, tile.get(), grid.domain(), cover);
      if (++*next_tile_ == grid.tiles().end()) next_tile_.reset();
      // Tiles without a selected cell count as well, to bound the work of a call.
      runs += 1 + static_cast<int64_t>(cells.after.size());
      if (cells.after.empty()) continue;
      MapChange& written = Add(ChangeKind::kCells, told);
      written.layer = grid.spec().name;
      written.grid = grid.geometry();
      written.cells = std::move(cells.after);
    }
  }

  const SnapshotPtr snapshot_;
  const std::vector<std::shared_ptr<const FollowedLayer>> layers_;
  bool begun_ = false;
  size_t current_ = 0;
  // Position in the current layer.
  bool in_layer_ = false;
  std::vector<ObjectPtr> objects_;
  size_t next_object_ = 0;
  std::optional<TileMap::const_iterator> next_tile_;  // Nullopt: no tile is left.
};

absl::StatusOr<Follower> Follower::Make(WatchFilter filter, StructurePtr structure) {
  HYPERMAP_ASSIGN_OR_RETURN(std::string frame, structure->ResolveFrame(filter.frame_id));
  std::set<std::string> classes;
  for (const std::string& word : filter.classes) {
    std::string folded = FoldLabel(word);
    if (folded.empty()) return absl::InvalidArgumentError("classes: an empty word");
    classes.insert(std::move(folded));
  }
  Follower follower(std::move(filter), std::move(frame), std::move(classes));
  follower.MoveTo(structure);
  return follower;
}

Follower::Follower(WatchFilter filter, std::string frame_id, std::set<std::string> classes)
    : filter_(std::move(filter)), frame_id_(std::move(frame_id)), classes_(std::move(classes)) {}
Follower::Follower(Follower&&) noexcept = default;
Follower& Follower::operator=(Follower&&) noexcept = default;
Follower::~Follower() = default;

bool Follower::Follows(const std::string& layer) const {
  return filter_.layers.empty() ||
         std::find(filter_.layers.begin(), filter_.layers.end(), layer) != filter_.layers.end();
}

void Follower::MoveTo(const StructurePtr& structure) {
  if (structure == structure_) return;
  layers_.clear();
  for (const auto& [name, layer] : structure->layers) {
    if (Follows(name)) {
      layers_.emplace(name, std::make_shared<FollowedLayer>(*this, *structure, layer));
    }
  }
  structure_ = structure;
}

bool Follower::NeedsReset(const MapStructure& before, const MapStructure& after) const {
  for (const auto& [name, followed] : layers_) {
    const LayerStructure* layer = after.FindLayer(name);
    // A layer that was deleted or recreated needs no reset: the commit has events for it.
    if (!layer || layer->spec.frame_id != followed->spec().frame_id) continue;
    if (!classes_.empty() && layer->spec.aliases != followed->spec().aliases) {
      return true;
    }
    // As stored, without an area, nothing is converted to the caller's frame.
    if (as_stored() && !filter_.area) continue;
    const auto was = before.frames.Lookup(frame_id_, layer->spec.frame_id);
    const auto is = after.frames.Lookup(frame_id_, layer->spec.frame_id);
    if (was.ok() != is.ok() || (was.ok() && !(*was == *is))) return true;
  }
  return false;
}

Follower::Told Follower::Tell(const std::vector<Change>& changes, const StructurePtr& structure) {
  const bool reset = structure != structure_ && NeedsReset(*structure_, *structure);
  MoveTo(structure);
  if (reset) return {true, {}};
  ChangeSelector selector(*this);
  for (const Change& change : changes) std::visit(selector, change);
  return {false, std::move(selector).Take()};
}

std::unique_ptr<SelectionReader> Follower::Read(SnapshotPtr snapshot) {
  MoveTo(StructureOf(*snapshot));
  if (as_stored()) {
    std::vector<std::shared_ptr<const FollowedLayer>> layers;
    for (const auto& [name, layer] : layers_) layers.push_back(layer);
    return std::make_unique<StoredReader>(std::move(snapshot), std::move(layers));
  }
  Scope scope;
  scope.frame_id = frame_id_;
  for (const auto& [name, layer] : layers_) scope.layers.push_back(name);
  if (scope.layers.empty()) return std::make_unique<ContentReader>(nullptr, classes_);
  const Polygon area =
      filter_.area ? *filter_.area : Everywhere(*snapshot, frame_id_, scope.layers);
  // ContentIn fails only if the frame is unknown, that is, if the layer that named it was deleted.
  // Then no layer is connected to the frame, and there is nothing to read.
  absl::StatusOr<std::unique_ptr<PartReader>> parts = ContentIn(std::move(snapshot), scope, area);
  return std::make_unique<ContentReader>(parts.ok() ? *std::move(parts) : nullptr, classes_);
}

}  // namespace hypermap
