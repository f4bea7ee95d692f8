#include "map/watch/follower.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/edits/byte_size.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "map/query/query.h"
#include "map/values/value_query.h"
#include "map/watch/cell_changes.h"
#include "map/watch/followed_layer.h"

namespace hypermap {
namespace {

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

// Reads a snapshot in the caller's frame.
class ContentReader : public SelectionReader {
 public:
  ContentReader(std::unique_ptr<PartReader> parts, std::shared_ptr<const PreparedFilter> filter)
      : parts_(std::move(parts)), filter_(std::move(filter)) {}

  std::vector<MapChange> Next(int max_items) override {
    std::vector<MapChange> told;
    if (done()) return told;
    LayerPart part = parts_->Next(max_items);
    if (part.status != AnswerStatus::kValue) return told;
    const LayerSpec& spec = part.layer->spec();
    MapChange change;
    change.layer = spec.name;
    change.caller_from_layer = part.caller_from_layer;
    const LabelSet labels(filter_->classes(), spec.aliases);
    for (ObjectPtr& object : part.part.objects) {
      if (!labels.Selects(object->label)) continue;
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
  const std::shared_ptr<const PreparedFilter> filter_;
};

// Reads a snapshot as stored: transforms, then the layers by name, each before its content.
class StoredReader : public SelectionReader {
 public:
  // `structure` is the snapshot's.
  StoredReader(SnapshotPtr snapshot, StructurePtr structure, std::shared_ptr<PreparedFilter> filter)
      : snapshot_(std::move(snapshot)),
        structure_(std::move(structure)),
        filter_(std::move(filter)),
        layers_(filter_->LayersIn(*structure_)) {}

  std::vector<MapChange> Next(int max_items) override {
    std::vector<MapChange> told;
    if (!std::exchange(begun_, true)) TellTransforms(&told);
    if (done()) return told;
    const std::string& name = layers_[current_];
    const Layer& layer = *snapshot_->FindLayer(name);
    if (!std::exchange(in_layer_, true)) BeginLayer(layer, &told);
    const FollowedLayer followed(filter_.get(), *structure_, *structure_->FindLayer(name));
    const auto* grid = AsGrid(&layer);
    if (!grid) {
      TellObjects(followed, max_items, &told);
    } else if (followed.connected()) {
      TellTiles(*grid, followed, max_items, &told);
    } else {
      next_tile_.reset();
    }
    if (filter_->area()) filter_->area()->FreeExcess();
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
  void TellTiles(const GridLayer& grid, const FollowedLayer& followed, int max_items,
                 std::vector<MapChange>* told) {
    int64_t runs = 0;
    for (; next_tile_ && runs < max_items;) {
      const auto& [index, tile] = **next_tile_;
      CellChanges cells;
      if (followed.MaySelect(index)) {
        cells = ChangedCells(index, nullptr, tile.get(), grid.domain(), followed.cover());
      }
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
  const StructurePtr structure_;
  const std::shared_ptr<PreparedFilter> filter_;
  const std::vector<std::string> layers_;
  bool begun_ = false;
  size_t current_ = 0;
  // Position in the current layer.
  bool in_layer_ = false;
  std::vector<ObjectPtr> objects_;
  size_t next_object_ = 0;
  std::optional<TileMap::const_iterator> next_tile_;  // Nullopt: no tile is left.
};

}  // namespace

// Converts the changes of a commit for the subscriber. The changes of content come layer by layer,
// so that only the current layer is compared with the filter at any time.
class Follower::ChangeSelector {
 public:
  // `structure` is the one after the commit.
  ChangeSelector(PreparedFilter* filter, const MapStructure& structure)
      : filter_(filter), structure_(structure) {}

  void operator()(const LayerCreated& change) {
    if (filter_->Follows(change.spec.name)) {
      AddLayer(ChangeKind::kLayerCreated, change.spec.name);
    }
  }
  void operator()(const LayerDeleted& change) {
    if (!filter_->Follows(change.spec.name)) return;
    MapChange told;
    told.kind = ChangeKind::kLayerDeleted;
    told.layer = change.spec.name;
    Add(std::move(told));
  }
  void operator()(const AliasesSet& change) { AddLayer(ChangeKind::kLayerChanged, change.layer); }
  void operator()(const ExtentGrown& change) { AddLayer(ChangeKind::kLayerChanged, change.layer); }
  void operator()(const TransformSet& change) {
    MapChange told;
    told.kind = ChangeKind::kTransform;
    told.transform = change.transform;
    Add(std::move(told));
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
    if (!layer || !layer->domain()) return;
    // Both tests are much cheaper than comparing the tile's cells.
    if (!layer->MaySelect(change.index)) return;
    const CellCover* cover = layer->cover();
    if (cover && cover->bounds().Intersection(CellsOf(change.index)).empty()) return;
    CellChanges cells = ChangedCells(change.index, change.before.get(), change.after.get(),
                                     *layer->domain(), cover);
    if (cells.after.empty()) return;
    MapChange told;
    told.kind = ChangeKind::kCells;
    told.layer = change.layer;
    told.caller_from_layer = layer->caller_from_layer();
    told.grid = layer->spec().grid;
    told.cells = std::move(cells.after);
    items_ += static_cast<int64_t>(told.cells.size()) - 1;
    Add(std::move(told));
  }

  std::vector<MapChange> Take() && { return std::move(told_); }
  // The number of objects and runs told so far, and of other changes.
  int64_t items() const { return items_; }

 private:
  // Returns null if the layer is not followed, or is no longer there. Valid until the next call.
  const FollowedLayer* Find(const std::string& name) {
    if (current_ && current_->spec().name == name) return &*current_;
    const LayerStructure* layer = filter_->Follows(name) ? structure_.FindLayer(name) : nullptr;
    if (!layer) return nullptr;
    return &current_.emplace(filter_, structure_, *layer);
  }

  void Add(MapChange told) {
    ++items_;
    told_.push_back(std::move(told));
  }

  void AddLayer(ChangeKind kind, const std::string& name) {
    const FollowedLayer* layer = Find(name);
    if (!layer) return;  // Not followed, or deleted in the same commit.
    MapChange told;
    told.kind = kind;
    told.layer = name;
    told.caller_from_layer = layer->caller_from_layer();
    told.layer_now = layer->layer();
    Add(std::move(told));
  }

  void AddObject(ChangeKind kind, const FollowedLayer& layer, ObjectId id, ObjectPtr object) {
    MapChange told;
    told.kind = kind;
    told.layer = layer.spec().name;
    told.caller_from_layer = layer.caller_from_layer();
    told.object_id = id;
    told.object = std::move(object);
    Add(std::move(told));
  }

  PreparedFilter* const filter_;
  const MapStructure& structure_;
  std::optional<FollowedLayer> current_;
  std::vector<MapChange> told_;
  int64_t items_ = 0;
};

// Reads a commit. A tile is not split, so that a part may exceed `max_items` by its runs.
class Follower::CommitReader : public SelectionReader {
 public:
  // `structure` is the one after the commit.
  CommitReader(std::shared_ptr<const std::vector<Change>> changes, StructurePtr structure,
               std::shared_ptr<PreparedFilter> filter)
      : changes_(std::move(changes)),
        structure_(std::move(structure)),
        filter_(std::move(filter)) {}

  std::vector<MapChange> Next(int max_items) override {
    ChangeSelector selector(filter_.get(), *structure_);
    // Changes that are not selected count as well, to bound the work of a call.
    for (int looks = 0; !done() && looks < kLooksPerItem * max_items; ++looks) {
      std::visit(selector, (*changes_)[next_++]);
      if (selector.items() >= max_items) break;
    }
    if (filter_->area()) filter_->area()->FreeExcess();
    return std::move(selector).Take();
  }

  bool done() const override { return next_ == changes_->size(); }

 private:
  static constexpr int kLooksPerItem = 4;

  const std::shared_ptr<const std::vector<Change>> changes_;
  const StructurePtr structure_;
  const std::shared_ptr<PreparedFilter> filter_;
  size_t next_ = 0;
};

int64_t Follower::MaxBytes(const WatchFilter& filter) {
  // A class is there as it was asked and folded, in a node of a set.
  constexpr int64_t kSetNodeBytes = 48;
  return 2 * ByteSize(filter) + kSetNodeBytes * static_cast<int64_t>(filter.classes.size()) +
         (filter.area ? AreaInFrames::MaxBytes(*filter.area) : 0);
}

absl::StatusOr<Follower> Follower::Make(WatchFilter filter, StructurePtr structure) {
  HYPERMAP_ASSIGN_OR_RETURN(std::string frame, structure->ResolveFrame(filter.frame_id));
  std::set<std::string> classes;
  for (const std::string& word : filter.classes) {
    std::string folded = FoldLabel(word);
    if (folded.empty()) return absl::InvalidArgumentError("classes: an empty word");
    classes.insert(std::move(folded));
  }
  return Follower(
      std::make_unique<PreparedFilter>(std::move(filter), std::move(frame), std::move(classes)),
      std::move(structure));
}

Follower::Follower(std::unique_ptr<PreparedFilter> filter, StructurePtr structure)
    : filter_(std::move(filter)), structure_(std::move(structure)) {}
Follower::Follower(Follower&&) noexcept = default;
Follower& Follower::operator=(Follower&&) noexcept = default;
Follower::~Follower() = default;

const AreaInFrames* Follower::area() const { return filter_->area(); }

bool Follower::NeedsReset(const MapStructure& before, const MapStructure& after) const {
  bool means_other_labels = false;
  if (!filter_->classes().empty()) {
    after.layers.VisitUnshared(before.layers, [&](const auto& entry, const auto* older) {
      if (!older || older == &entry || !filter_->Follows(entry.first)) return;
      const LayerSpec& was = older->second.spec;
      const LayerSpec& is = entry.second.spec;
      // A layer that was recreated in another frame needs no reset: the commit has events for it.
      if (was.frame_id == is.frame_id && was.aliases != is.aliases) means_other_labels = true;
    });
  }
  return means_other_labels || HasMoved(before, after);
}

bool Follower::HasMoved(const MapStructure& before, const MapStructure& after) const {
  // As stored, without an area, nothing is converted to the caller's frame.
  if (filter_->as_stored() && !filter_->area()) return false;
  if (after.frames.UnsharedBytes(before.frames) == 0) return false;
  absl::flat_hash_set<absl::string_view> compared;
  for (const auto& [name, layer] : after.layers) {
    if (!filter_->Follows(name)) continue;
    const std::string& frame_id = layer.spec.frame_id;
    const LayerStructure* older = before.FindLayer(name);
    // The commit has events for layers that were created or recreated in another frame.
    if (!older || older->spec.frame_id != frame_id || !compared.insert(frame_id).second) continue;
    const auto was = before.frames.Lookup(filter_->frame_id(), frame_id);
    const auto is = after.frames.Lookup(filter_->frame_id(), frame_id);
    if (was.ok() != is.ok() || (was.ok() && !(*was == *is))) return true;
  }
  return false;
}

bool Follower::MoveTo(const StructurePtr& structure) {
  const StructurePtr before = std::exchange(structure_, structure);
  return structure != before && NeedsReset(*before, *structure);
}

Follower::Told Follower::Tell(const std::vector<Change>& changes, const StructurePtr& structure) {
  if (MoveTo(structure)) return {true, {}};
  ChangeSelector selector(filter_.get(), *structure);
  for (const Change& change : changes) std::visit(selector, change);
  if (filter_->area()) filter_->area()->FreeExcess();
  return {false, std::move(selector).Take()};
}

std::unique_ptr<SelectionReader> Follower::TellInParts(
    std::shared_ptr<const std::vector<Change>> changes, StructurePtr structure) {
  if (MoveTo(structure)) return nullptr;
  return std::make_unique<CommitReader>(std::move(changes), std::move(structure), filter_);
}

int64_t Follower::BytesOf(const std::vector<Change>& changes) {
  return std::accumulate(changes.begin(), changes.end(), int64_t{0},
                         [](int64_t sum, const Change& change) { return sum + ByteSize(change); });
}

std::unique_ptr<SelectionReader> Follower::Read(SnapshotPtr snapshot, StructurePtr structure) {
  structure_ = std::move(structure);
  if (filter_->as_stored()) {
    return std::make_unique<StoredReader>(std::move(snapshot), structure_, filter_);
  }
  Scope scope;
  scope.frame_id = filter_->frame_id();
  scope.layers = filter_->LayersIn(*structure_);
  if (scope.layers.empty()) return std::make_unique<ContentReader>(nullptr, filter_);
  const Polygon area = filter_->area() ? filter_->area()->area()
                                       : Everywhere(*snapshot, scope.frame_id, scope.layers);
  // All layers need not be named.
  if (filter_->follows_all()) scope.layers.clear();
  // ContentIn fails only if the frame is unknown, that is, if the layer that named it was deleted.
  // Then no layer is connected to the frame, and there is nothing to read.
  absl::StatusOr<std::unique_ptr<PartReader>> parts = ContentIn(std::move(snapshot), scope, area);
  return std::make_unique<ContentReader>(parts.ok() ? *std::move(parts) : nullptr, filter_);
}

}  // namespace hypermap
