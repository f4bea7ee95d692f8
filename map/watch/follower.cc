#include "map/watch/follower.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
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
    LayerAnswerPart part = parts_->Next(max_items);
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

// Reads a snapshot as stored: transforms, then the layers by name, each before its content. A part
// has content of one layer only. Tiles are not split, so that a part may exceed `max_items` by the
// runs of one tile.
class StoredReader : public SelectionReader {
 public:
  // `structure` is the snapshot's.
  StoredReader(SnapshotPtr snapshot, StructurePtr structure, std::shared_ptr<PreparedFilter> filter)
      : snapshot_(std::move(snapshot)),
        structure_(std::move(structure)),
        filter_(std::move(filter)),
        layers_(filter_->LayersIn(*structure_)) {}

  std::vector<MapChange> Next(int max_items) override {
    if (!std::exchange(begun_, true)) TellTransforms();
    if (current_ == layers_.size()) return std::exchange(told_, {});
    const std::string& name = layers_[current_];
    if (!layer_) layer_.emplace(filter_.get(), *structure_, *structure_->FindLayer(name));
    if (!std::exchange(in_layer_, true)) BeginLayer(*snapshot_->FindLayer(name));
    if (!CompletePart(max_items)) return {};
    layer_.reset();
    items_ = 0;
    if (LayerIsRead()) {
      in_layer_ = false;
      ++current_;
    }
    return std::exchange(told_, {});
  }

  bool done() const override { return begun_ && current_ == layers_.size(); }

 private:
  MapChange& Add(ChangeKind kind) {
    MapChange& told = told_.emplace_back();
    told.kind = kind;
    if (layer_) told.layer = layer_->spec().name;
    return told;
  }

  void TellTransforms() {
    for (FrameTransform& transform : snapshot_->frames.transforms()) {
      Add(ChangeKind::kTransform).transform = std::move(transform);
    }
  }

  void BeginLayer(const Layer& layer) {
    grid_ = AsGrid(&layer);
    Add(ChangeKind::kLayerCreated).layer_now =
        LayerStructure{layer.spec(), grid_ ? grid_->extent() : CellBox(),
                       snapshot_->LayerVersionOf(layer.spec().name)};
    objects_.clear();
    next_object_ = 0;
    if (const auto* semantic = AsSemantic(&layer)) {
      objects_ = semantic->Objects();
    } else if (layer_->connected() && !grid_->tiles().empty()) {
      next_tile_ = grid_->tiles().begin();
    }
  }

  bool LayerIsRead() const { return next_object_ == objects_.size() && !next_tile_; }

  // Reads on in the layer until the part is complete, but for one step at most. Returns whether the
  // part is complete.
  bool CompletePart(int max_items) {
    const auto is_complete = [&] { return LayerIsRead() || items_ >= max_items; };
    for (int64_t looks = 0; !is_complete() && looks < kLooksPerStep;) {
      if (filter_->area() && IsCancelled()) break;
      looks += next_tile_ ? ReadRow() : ReadObject();
    }
    if (filter_->area()) filter_->area()->FreeExcess();
    return is_complete();
  }

  // Objects and tiles that are not selected count as items, too, to bound the work of a part.

  // Returns the looks that it took.
  int64_t ReadObject() {
    ObjectPtr& object = objects_[next_object_++];
    ++items_;
    const int64_t looks = 1 + layer_->LooksAt(object);
    if (!layer_->Selects(object)) return looks;
    MapChange& put = Add(ChangeKind::kPut);
    put.object_id = object->id;
    put.object = std::move(object);
    return looks;
  }

  // Reads a row of the next tile. Returns the looks that it took.
  int64_t ReadRow() {
    int64_t looks = 1;
    const auto& [index, tile] = **next_tile_;
    if (!comparison_) comparison_ = layer_->Compare(index, nullptr, tile.get());
    if (comparison_) looks += layer_->CompareRow(&*comparison_);
    if (comparison_ && !comparison_->done()) return looks;
    if (++*next_tile_ == grid_->tiles().end()) next_tile_.reset();
    ++items_;
    if (comparison_) TellCells(std::move(*comparison_).Take().after);
    comparison_.reset();
    return looks;
  }

  void TellCells(std::vector<CellRun> cells) {
    if (cells.empty()) return;
    items_ += static_cast<int64_t>(cells.size());
    MapChange& written = Add(ChangeKind::kCells);
    written.grid = grid_->geometry();
    written.cells = std::move(cells);
  }

  const SnapshotPtr snapshot_;
  const StructurePtr structure_;
  const std::shared_ptr<PreparedFilter> filter_;
  const std::vector<std::string> layers_;
  bool begun_ = false;
  size_t current_ = 0;
  // Position in the current layer.
  bool in_layer_ = false;
  std::optional<FollowedLayer> layer_;  // While a part is read.
  const GridLayer* grid_ = nullptr;     // Null: the layer is not a grid.
  std::vector<ObjectPtr> objects_;
  size_t next_object_ = 0;
  std::optional<TileMap::const_iterator> next_tile_;  // Nullopt: no tile is left.
  std::optional<TileComparison> comparison_;          // Compares next_tile_, once it has begun.
  // The part so far.
  std::vector<MapChange> told_;
  int64_t items_ = 0;
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
    looks_ += layer->LooksAt(change.before) + layer->LooksAt(change.after);
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
    if (!layer) return;
    looks_ += layer->LooksAt(change.before);
    if (layer->Selects(change.before)) {
      AddObject(ChangeKind::kRemove, *layer, change.before->id, nullptr);
    }
  }
  // Only begins to compare the tile: until compares_tile() is false, CompareRow must be called
  // before the next change.
  void operator()(const TileWritten& change) {
    const FollowedLayer* layer = Find(change.layer);
    if (!layer || !layer->domain()) return;
    comparison_ = layer->Compare(change.index, change.before.get(), change.after.get());
  }
  bool compares_tile() const { return comparison_.has_value(); }
  void CompareRow() {
    looks_ += current_->CompareRow(&*comparison_);
    if (!comparison_->done()) return;
    TellCells(std::move(*comparison_).Take().after);
    comparison_.reset();
  }

  // Forgets the layer, unless a tile of it is compared. To be called before other work begins.
  void Rest() {
    if (filter_->area()) filter_->area()->FreeExcess();
    if (!comparison_) current_.reset();
  }
  // Returns what was told since the last call.
  std::vector<MapChange> Take() {
    items_ = 0;
    return std::exchange(told_, {});
  }
  // The number of objects and runs told since the last Take, and of other changes.
  int64_t items() const { return items_; }
  // The work so far.
  int64_t looks() const { return looks_; }

 private:
  // Returns null if the layer is not followed, or is no longer there. Valid until the next call.
  const FollowedLayer* Find(const std::string& name) {
    ++looks_;
    if (current_ && current_->spec().name == name) return &*current_;
    const LayerStructure* layer = filter_->Follows(name) ? structure_.FindLayer(name) : nullptr;
    if (!layer) return nullptr;
    current_.emplace(filter_, structure_, *layer);
    looks_ += current_->looks();
    return &*current_;
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

  void TellCells(std::vector<CellRun> cells) {
    if (cells.empty()) return;
    MapChange told;
    told.kind = ChangeKind::kCells;
    told.layer = current_->spec().name;
    told.caller_from_layer = current_->caller_from_layer();
    told.grid = current_->spec().grid;
    told.cells = std::move(cells);
    items_ += static_cast<int64_t>(told.cells.size()) - 1;
    Add(std::move(told));
  }

  PreparedFilter* const filter_;
  const MapStructure& structure_;
  std::optional<FollowedLayer> current_;
  std::optional<TileComparison> comparison_;  // Compares a tile of current_.
  std::vector<MapChange> told_;
  int64_t items_ = 0;
  int64_t looks_ = 0;
};

// Reads a commit. A tile is not split, so that a part may exceed `max_items` by its runs.
class Follower::CommitReader : public SelectionReader {
 public:
  // `structure` is the one after the commit.
  CommitReader(std::shared_ptr<const std::vector<Change>> changes, StructurePtr structure,
               std::shared_ptr<PreparedFilter> filter)
      : changes_(std::move(changes)),
        structure_(std::move(structure)),
        filter_(std::move(filter)),
        selector_(filter_.get(), *structure_) {}

  std::vector<MapChange> Next(int max_items) override {
    const int64_t end = selector_.looks() + kLooksPerStep;
    while (!PartIsComplete(max_items) && selector_.looks() < end) {
      if (filter_->area() && IsCancelled()) break;
      if (selector_.compares_tile()) {
        selector_.CompareRow();
      } else {
        std::visit(selector_, (*changes_)[next_++]);
        ++changes_of_part_;
      }
    }
    selector_.Rest();
    if (!PartIsComplete(max_items)) return {};
    changes_of_part_ = 0;
    return selector_.Take();
  }

  bool done() const override { return next_ == changes_->size() && !selector_.compares_tile(); }

 private:
  static constexpr int64_t kChangesPerItem = 4;

  bool PartIsComplete(int max_items) const {
    if (selector_.compares_tile()) return false;
    // Changes that are not selected count as well, to bound the work of a part.
    return done() || selector_.items() >= max_items ||
           changes_of_part_ >= kChangesPerItem * max_items;
  }

  const std::shared_ptr<const std::vector<Change>> changes_;
  const StructurePtr structure_;
  const std::shared_ptr<PreparedFilter> filter_;
  ChangeSelector selector_;
  size_t next_ = 0;
  int64_t changes_of_part_ = 0;  // That were looked at.
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

std::unique_ptr<SelectionReader> Follower::ReadCommit(
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
