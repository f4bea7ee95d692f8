#include "map/objects/object_index.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/container/inlined_vector.h"
#include "base/cancellation/cancellation.h"
#include "map/objects/prefetch.h"
#include "map/values/value_query.h"

namespace hypermap {
namespace {

// Maximal number of recent changes that are not in a run. Each change copies them, and each query
// scans them.
constexpr size_t kMaxRecent = 32;

// A run is merged with newer entries if it is at most this many times as large as they are. A
// larger ratio makes fewer runs and more merges: after 250,000 changes, a query reads four runs,
// and each change has been packed thirteen times.
constexpr size_t kMergeRatio = 4;

// If the changes exceed this fraction (1 / kShareToPack) of the first run, everything is packed
// anew, so that hidden entries never take more than a share of memory and of a query's time.
constexpr size_t kShareToPack = 4;

// Bytes of the index for an object, and for each of its words: a tree of its own, if no other
// object has the word.
constexpr int64_t kBytesOfEntry = 128;
constexpr int64_t kBytesOfWord = 448;

// Bytes that an object takes with its part of the index.
int64_t IndexedBytes(const SemanticObject& object) {
  const auto num_words = static_cast<int64_t>(1 + object.tags.size());
  return ByteSize(object) + kBytesOfEntry + num_words * kBytesOfWord;
}

bool ReachesBorder(const Box& box, const Box& outer) {
  return box.min.x <= outer.min.x || box.min.y <= outer.min.y || box.max.x >= outer.max.x ||
         box.max.y >= outer.max.y;
}

}  // namespace

ObjectIndex::ObjectIndex(std::vector<ObjectPtr> objects)
    : size_(static_cast<int64_t>(objects.size())) {
  if (objects.empty()) return;
  const auto by_id = [](const ObjectPtr& a, const ObjectPtr& b) { return a->id < b->id; };
  if (!std::is_sorted(objects.begin(), objects.end(), by_id)) {
    std::sort(objects.begin(), objects.end(), by_id);
  }
  std::vector<ObjectEntry> entries;
  entries.reserve(objects.size());
  for (ObjectPtr& object : objects) {
    const ObjectId id = object->id;
    byte_size_ += IndexedBytes(*object);
    entries.push_back({id, std::move(object)});
  }
  objects = {};
  runs_.push_back({std::make_shared<const ObjectRun>(std::move(entries))});
  bounds_ = runs_.front().run->bounds();
}

ObjectIndex::Change ObjectIndex::MakeChange(ObjectId id, const ObjectPtr& object) {
  if (!object) return {id, nullptr, Box(), ""};
  return {id, object, object->shape.bounds(), FoldLabel(object->label)};
}

bool ObjectIndex::Change::HasWord(WordKind kind, const std::string& folded) const {
  if (!object) return false;
  if (kind == WordKind::kLabel) return folded_label == folded;
  return std::any_of(object->tags.begin(), object->tags.end(),
                     [&folded](const std::string& tag) { return FoldLabel(tag) == folded; });
}

ObjectIndex ObjectIndex::With(const absl::btree_map<ObjectId, ObjectPtr>& changes) const {
  ObjectIndex next = *this;
  bool may_shrink = false;
  for (const auto& [id, object] : changes) {
    const ObjectPtr* const before = Find(id);
    next.size_ += (object ? 1 : 0) - (before ? 1 : 0);
    if (object) next.byte_size_ += IndexedBytes(*object);
    if (before) next.byte_size_ -= IndexedBytes(**before);
    // Only an object at the border can make the bounds smaller by moving or leaving.
    may_shrink = may_shrink || (before && ReachesBorder((*before)->shape.bounds(), bounds_));
    if (object) next.bounds_.Extend(object->shape.bounds());
  }
  next.AddRecent(changes);
  if (may_shrink && !next.ShrinkBounds()) next.MergeUntilBoundsAreKnown();
  return next;
}

void ObjectIndex::AddRecent(const absl::btree_map<ObjectId, ObjectPtr>& changes) {
  if (changes.size() == 1) {
    const auto& [id, object] = *changes.begin();
    const auto place = std::lower_bound(recent_.begin(), recent_.end(), id,
                                        [](const Change& c, ObjectId i) { return c.id < i; });
    if (place != recent_.end() && place->id == id) {
      *place = MakeChange(id, object);
    } else {
      recent_.insert(place, MakeChange(id, object));
    }
  } else {
    std::vector<Change> merged;
    merged.reserve(recent_.size() + changes.size());
    for (const auto& [id, object] : changes) merged.push_back(MakeChange(id, object));
    const auto by_id = [](const Change& a, const Change& b) { return a.id < b.id; };
    std::vector<Change> kept;
    for (Change& change : recent_) {
      if (!changes.contains(change.id)) kept.push_back(std::move(change));
    }
    recent_.clear();
    std::merge(std::make_move_iterator(merged.begin()), std::make_move_iterator(merged.end()),
               std::make_move_iterator(kept.begin()), std::make_move_iterator(kept.end()),
               std::back_inserter(recent_), by_id);
  }
  if (recent_.size() > kMaxRecent) {
    FoldRecent();
    return;
  }
  recent_bounds_ = Box();
  for (const Change& change : recent_) recent_bounds_.Extend(change.box);
}

void ObjectIndex::FoldRecent() {
  size_t first = runs_.size();
  size_t num_merged = recent_.size();
  while (first > 0 && runs_[first - 1].run->size() <= kMergeRatio * num_merged) {
    num_merged += runs_[--first].run->size();
  }
  // Count the entries that would be outside of the first run.
  size_t num_changes = num_merged;
  for (size_t i = 1; i < first; ++i) num_changes += runs_[i].run->size();
  if (first > 0 && num_changes > runs_.front().run->size() / kShareToPack) first = 0;
  MergeFrom(first);
}

void ObjectIndex::MergeFrom(size_t first) {
  std::vector<ObjectEntry> merged = RecentEntries();
  recent_.clear();
  recent_bounds_ = Box();
  while (runs_.size() > first) {
    merged = Merge(std::move(merged), runs_.back().run->Entries());
    runs_.pop_back();
  }
  // Nothing older is left that a removal could hide.
  if (first == 0) {
    merged.erase(std::remove_if(merged.begin(), merged.end(),
                                [](const ObjectEntry& entry) { return !entry.object; }),
                 merged.end());
  }
  if (merged.empty()) return;
  runs_.push_back({std::make_shared<const ObjectRun>(std::move(merged))});
}

std::vector<ObjectEntry> ObjectIndex::RecentEntries() const {
  std::vector<ObjectEntry> entries;
  entries.reserve(recent_.size());
  for (const Change& change : recent_) entries.push_back({change.id, change.object});
  return entries;
}

bool ObjectIndex::ShrinkBounds() {
  std::array<double, kNumSides> reach;
  reach.fill(-std::numeric_limits<double>::infinity());
  for (int side = 0; side < kNumSides; ++side) {
    for (const Change& change : recent_) {
      if (!change.box.empty()) reach[side] = std::max(reach[side], Reach(change.box, side));
    }
    for (size_t i = 0; i < runs_.size(); ++i) {
      const ObjectRun& run = *runs_[i].run;
      const absl::Span<const int32_t> farthest = run.Farthest(side);
      size_t& hidden = runs_[i].hidden_farthest[side];
      // Entries are never removed from a run or made visible again, so the count only grows.
      while (hidden < farthest.size() && IsHidden(i, run.id(farthest[hidden]))) ++hidden;
      if (hidden < farthest.size()) {
        const Box box = run.object(farthest[hidden])->shape.bounds();
        reach[side] = std::max(reach[side], Reach(box, side));
      } else if (!run.HasAllFarthest(side)) {
        return false;
      }
    }
  }
  bounds_ = {{-reach[0], -reach[1]}, {reach[2], reach[3]}};
  return true;
}

void ObjectIndex::MergeUntilBoundsAreKnown() {
  for (size_t first = runs_.size(); first-- > 0;) {
    MergeFrom(first);
    if (ShrinkBounds()) return;
  }
}

bool ObjectIndex::IsRecent(ObjectId id) const {
  if (recent_.empty() || id < recent_.front().id || id > recent_.back().id) return false;
  const auto it = std::lower_bound(recent_.begin(), recent_.end(), id,
                                   [](const Change& c, ObjectId i) { return c.id < i; });
  return it != recent_.end() && it->id == id;
}

bool ObjectIndex::IsHidden(size_t run, ObjectId id) const {
  if (IsRecent(id)) return true;
  for (size_t i = run + 1; i < runs_.size(); ++i) {
    if (runs_[i].run->IndexOf(id) >= 0) return true;
  }
  return false;
}

const ObjectPtr* ObjectIndex::Find(ObjectId id) const {
  const auto it = std::lower_bound(recent_.begin(), recent_.end(), id,
                                   [](const Change& c, ObjectId i) { return c.id < i; });
  if (it != recent_.end() && it->id == id) return it->object ? &it->object : nullptr;
  for (size_t i = runs_.size(); i-- > 0;) {
    const int index = runs_[i].run->IndexOf(id);
    if (index < 0) continue;
    const ObjectPtr& object = runs_[i].run->object(index);
    return object ? &object : nullptr;
  }
  return nullptr;
}

std::vector<ObjectPtr> ObjectIndex::Objects() const {
  std::vector<ObjectEntry> entries = RecentEntries();
  for (size_t i = runs_.size(); i-- > 0;) {
    entries = Merge(std::move(entries), runs_[i].run->Entries());
  }
  std::vector<ObjectPtr> objects;
  objects.reserve(size_);
  for (ObjectEntry& entry : entries) {
    if (entry.object) objects.push_back(std::move(entry.object));
  }
  return objects;
}

SetDigest ObjectIndex::Digest(ObjectDigest digest_of) const {
  SetDigest digest;
  absl::flat_hash_set<ObjectId> newer;  // of the entries that are newer than those of the run
  for (const Change& change : recent_) {
    newer.insert(change.id);
    if (change.object) digest.Add(digest_of(*change.object));
  }
  for (size_t i = runs_.size(); i-- > 0;) {
    const ObjectRun& run = *runs_[i].run;
    digest.Add(run.Digest(digest_of));
    for (const ObjectId id : newer) {
      const int hidden = run.IndexOf(id);
      if (hidden >= 0 && run.object(hidden)) digest.Remove(digest_of(*run.object(hidden)));
    }
    for (size_t entry = 0; i > 0 && entry < run.size(); ++entry) newer.insert(run.id(entry));
  }
  return digest;
}

// Collects the candidates that a run's index finds, refines them in groups, so that the waits for
// memory of a group overlap, and passes the matches on. Takes no more once the work of this thread
// is cancelled.
class ObjectIndex::Refiner {
 public:
  // If `box` is null, every object that is not hidden is passed on.
  Refiner(const ObjectIndex& index, const Box* box, ObjectVisitor visit)
      : index_(index), box_(box), visit_(visit) {}

  void Take(size_t run, int item) {
    if (is_cancelled_) return;
    const ObjectPtr& object = index_.runs_[run].run->object(item);
    __builtin_prefetch(&object);
    found_.push_back({run, item, &object});
    if (found_.size() == kGroup) Flush();
  }

  void Flush() {
    for (const Found& found : found_) PrefetchShape(**found.place);
    for (const auto& [run, item, place] : found_) {
      const Shape& shape = (*place)->shape;
      if (box_ && !shape.bounds().Intersects(*box_)) continue;
      // Last, because it searches all newer runs.
      if (index_.IsHidden(run, index_.runs_[run].run->id(item))) continue;
      PrefetchVertices(shape);
      visit_(*place);
    }
    found_.clear();
    if (++num_groups_ % kGroupsPerLook == 0) is_cancelled_ = IsCancelled();
  }

 private:
  static constexpr size_t kGroup = 32;
  static constexpr int kGroupsPerLook = 64;
  struct Found {
    size_t run;
    int item;
    const ObjectPtr* place;
  };

  const ObjectIndex& index_;
  const Box* const box_;
  const ObjectVisitor visit_;
  int num_groups_ = 0;
  bool is_cancelled_ = false;
  absl::InlinedVector<Found, kGroup> found_;
};

void ObjectIndex::VisitBox(const Box& box, ObjectVisitor visit) const {
  Refiner refiner(*this, &box, visit);
  for (size_t r = 0; r < runs_.size(); ++r) {
    runs_[r].run->by_place().Visit(box, [&](int item) { refiner.Take(r, item); });
  }
  refiner.Flush();
  if (!recent_bounds_.Intersects(box)) return;
  for (const Change& change : recent_) {
    if (change.box.Intersects(box)) visit(change.object);
  }
}

void ObjectIndex::VisitWord(WordKind kind, const std::string& folded, const Box* box,
                            ObjectVisitor visit) const {
  Refiner refiner(*this, box, visit);
  for (size_t r = 0; r < runs_.size(); ++r) {
    const PackedRTree* const tree = runs_[r].run->WithWord(kind, folded);
    if (tree == nullptr) continue;
    const auto take = [&](int item) { refiner.Take(r, item); };
    if (box) {
      tree->Visit(*box, take);
    } else {
      tree->VisitAll(take);
    }
  }
  refiner.Flush();
  for (const Change& change : recent_) {
    if (box && !change.box.Intersects(*box)) continue;
    if (change.HasWord(kind, folded)) visit(change.object);
  }
}

void ObjectIndex::VisitNearest(WordKind kind, const std::string& folded, const Point& p,
                               absl::FunctionRef<double(const ObjectPtr&, double)> visit) const {
  // The recent objects come first, so that their distances already limit the search of the runs.
  for (const Change& change : recent_) {
    if (change.HasWord(kind, folded)) visit(change.object, 0.0);
  }
  for (size_t r = 0; r < runs_.size(); ++r) {
    const ObjectRun& run = *runs_[r].run;
    const PackedRTree* const tree = run.WithWord(kind, folded);
    if (tree == nullptr) continue;
    double limit_m = std::numeric_limits<double>::infinity();
    tree->VisitNearest(p, [&](int item, double at_least_m) {
      if (!IsHidden(r, run.id(item))) limit_m = visit(run.object(item), at_least_m);
      return limit_m;
    });
  }
}

}  // namespace hypermap
