#include "map/layers/semantic_layer.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

// How many objects a cursor tests before it lets its caller breathe.
constexpr size_t kTestsPerPart = 4096;

// Lists shorter than this are searched one by one rather than through the tree.
constexpr size_t kFewMatches = 2048;

// The overlay is folded into a new base at this size: large enough that packing is rare, small
// enough that looking through it costs less than a query.
size_t MaxOverlay(size_t base_size) {
  return 64 + static_cast<size_t>(4.0 * std::sqrt(static_cast<double>(base_size)));
}

bool ById(const ObjectPtr& a, const ObjectPtr& b) { return a->id < b->id; }

// Whether the outer box may become smaller when `box`, which it holds, goes.
bool ReachesBorder(const Box& box, const Box& outer) {
  return box.min.x <= outer.min.x || box.min.y <= outer.min.y || box.max.x >= outer.max.x ||
         box.max.y >= outer.max.y;
}

// Gives candidates that pass the exact test against an area, or all of them, by id.
class ObjectCursor : public AnswerCursor {
 public:
  ObjectCursor(std::vector<ObjectPtr> candidates, const Polygon* area)
      : candidates_(std::move(candidates)) {
    std::sort(candidates_.begin(), candidates_.end(), ById);
    if (area) area_.emplace(*area);
  }

  AnswerPart Next(int max_items) override {
    AnswerPart part;
    const size_t stop = std::min(candidates_.size(), next_ + kTestsPerPart);
    while (next_ < stop && part.objects.size() < static_cast<size_t>(max_items)) {
      ObjectPtr& candidate = candidates_[next_++];
      if (!area_ || area_->Intersects(candidate->polygon)) {
        part.objects.push_back(std::move(candidate));
      }
    }
    return part;
  }

  bool done() const override { return next_ == candidates_.size(); }

 private:
  std::vector<ObjectPtr> candidates_;
  std::optional<PreparedPolygon> area_;
  size_t next_ = 0;
};

// Keeps the k nearest of the objects it is offered.
class NearestObjects {
 public:
  NearestObjects(const Point& p, int k) : p_(p), k_(k) {}

  void Offer(const ObjectPtr& object) {
    const Found found{Distance(object->polygon, p_), object};
    if (best_.size() == static_cast<size_t>(k_)) {
      if (!(found < best_.top())) return;
      best_.pop();
    }
    best_.push(found);
  }

  // Whether nothing at this distance or farther can still get in.
  bool IsClosedTo(double distance_m) const {
    return best_.size() == static_cast<size_t>(k_) && distance_m > best_.top().distance_m;
  }

  std::vector<Neighbour> Take() && {
    std::vector<Neighbour> result(best_.size());
    for (size_t i = result.size(); i-- > 0; best_.pop()) {
      result[i].distance_m = best_.top().distance_m;
      result[i].object = best_.top().object;
    }
    return result;
  }

 private:
  struct Found {
    double distance_m;
    ObjectPtr object;
    bool operator<(const Found& other) const {
      return std::pair(distance_m, object->id) < std::pair(other.distance_m, other.object->id);
    }
  };

  Point p_;
  int k_;
  std::priority_queue<Found> best_;  // farthest first
};

}  // namespace

SemanticLayer::SemanticLayer(LayerSpec spec) : SemanticLayer(std::move(spec), {}) {}

SemanticLayer::SemanticLayer(LayerSpec spec, std::vector<ObjectPtr> objects)
    : Layer(std::move(spec)), size_(static_cast<int64_t>(objects.size())) {
  base_ = Pack(std::move(objects));
  bounds_ = base_->by_box.bounds();
}

SemanticLayer::SemanticLayer(LayerSpec spec, std::shared_ptr<const Base> base,
                             absl::btree_map<ObjectId, ObjectPtr> overlay, int64_t size,
                             const Box& bounds)
    : Layer(std::move(spec)),
      base_(std::move(base)),
      overlay_(std::move(overlay)),
      size_(size),
      bounds_(bounds) {}

std::shared_ptr<const SemanticLayer::Base> SemanticLayer::Pack(std::vector<ObjectPtr> objects) {
  auto base = std::make_shared<Base>();
  std::sort(objects.begin(), objects.end(), ById);
  std::vector<Box> boxes;
  boxes.reserve(objects.size());
  for (size_t i = 0; i < objects.size(); ++i) {
    boxes.push_back(objects[i]->polygon.bounds());
    base->by_label[FoldLabel(objects[i]->label)].push_back(static_cast<int>(i));
    absl::flat_hash_set<std::string> tags;
    for (const std::string& tag : objects[i]->tags) {
      auto [folded, is_new] = tags.insert(FoldLabel(tag));
      if (is_new) base->by_tag[*folded].push_back(static_cast<int>(i));
    }
  }
  base->by_box = PackedRTree(boxes);
  base->objects = std::move(objects);
  return base;
}

std::shared_ptr<const SemanticLayer> SemanticLayer::With(
    const absl::btree_map<ObjectId, ObjectPtr>& changes) const {
  absl::btree_map<ObjectId, ObjectPtr> overlay = overlay_;
  int64_t size = size_;
  Box bounds = bounds_;
  bool may_shrink = false;
  for (const auto& [id, object] : changes) {
    const ObjectPtr before = Find(id);
    size += (object ? 1 : 0) - (before ? 1 : 0);
    may_shrink = may_shrink || (before && ReachesBorder(before->polygon.bounds(), bounds_));
    if (object) bounds.Extend(object->polygon.bounds());
    overlay[id] = object;
  }
  const bool fold = overlay.size() > MaxOverlay(base_->objects.size());
  std::shared_ptr<const SemanticLayer> next(
      new SemanticLayer(spec(), base_, std::move(overlay), size, bounds));
  if (!fold && !may_shrink) return next;
  std::vector<ObjectPtr> objects = next->Objects();
  if (fold) return std::make_shared<SemanticLayer>(spec(), std::move(objects));
  bounds = Box();
  for (const ObjectPtr& object : objects) bounds.Extend(object->polygon.bounds());
  return std::shared_ptr<const SemanticLayer>(
      new SemanticLayer(spec(), base_, next->overlay_, size, bounds));
}

std::shared_ptr<const SemanticLayer> SemanticLayer::WithAliases(ValueAliases aliases) const {
  LayerSpec spec = this->spec();
  spec.aliases = std::move(aliases);
  return std::shared_ptr<const SemanticLayer>(
      new SemanticLayer(std::move(spec), base_, overlay_, size_, bounds_));
}

ObjectPtr SemanticLayer::Find(ObjectId id) const {
  if (const auto changed = overlay_.find(id); changed != overlay_.end()) return changed->second;
  const auto& objects = base_->objects;
  const auto it = std::lower_bound(objects.begin(), objects.end(), id,
                                   [](const ObjectPtr& o, ObjectId i) { return o->id < i; });
  return it != objects.end() && (*it)->id == id ? *it : nullptr;
}

std::vector<ObjectPtr> SemanticLayer::Objects() const {
  std::vector<ObjectPtr> objects;
  objects.reserve(size_);
  for (const ObjectPtr& object : base_->objects) {
    if (!overlay_.contains(object->id)) objects.push_back(object);
  }
  for (const auto& [id, object] : overlay_) {
    if (object) objects.push_back(object);
  }
  std::sort(objects.begin(), objects.end(), ById);
  return objects;
}

void SemanticLayer::VisitBox(const Box& box,
                             absl::FunctionRef<void(const ObjectPtr&)> visit) const {
  base_->by_box.Visit(box, [&](int item) {
    const ObjectPtr& object = base_->objects[item];
    if (!overlay_.contains(object->id)) visit(object);
  });
  for (const auto& [id, object] : overlay_) {
    if (object && object->polygon.bounds().Intersects(box)) visit(object);
  }
}

bool SemanticLayer::Wanted::IsMetBy(const SemanticObject& object) const {
  if (tag.empty()) return labels.contains(FoldLabel(object.label));
  return std::any_of(object.tags.begin(), object.tags.end(),
                     [this](const std::string& t) { return FoldLabel(t) == tag; });
}

std::optional<SemanticLayer::Wanted> SemanticLayer::Translate(const ValueQuery& value) const {
  if (const auto* label = std::get_if<ValueLabel>(&value)) {
    return Wanted{LabelsFor(spec().aliases, label->label), ""};
  }
  if (const auto* tag = std::get_if<ValueTag>(&value)) return Wanted{{}, tag->tag};
  return std::nullopt;
}

void SemanticLayer::VisitMatches(const Wanted& wanted,
                                 absl::FunctionRef<void(const ObjectPtr&)> visit) const {
  for (const std::vector<int>* items : MatchesInBase(wanted)) {
    for (const int item : *items) {
      const ObjectPtr& object = base_->objects[item];
      if (!overlay_.contains(object->id)) visit(object);
    }
  }
  for (const auto& [id, object] : overlay_) {
    if (object && wanted.IsMetBy(*object)) visit(object);
  }
}

std::vector<const std::vector<int>*> SemanticLayer::MatchesInBase(const Wanted& wanted) const {
  std::vector<const std::vector<int>*> lists;
  const auto look_up = [&lists](const auto& index, const std::string& word) {
    if (const auto it = index.find(word); it != index.end()) lists.push_back(&it->second);
  };
  for (const std::string& label : wanted.labels) look_up(base_->by_label, label);
  if (!wanted.tag.empty()) look_up(base_->by_tag, wanted.tag);
  return lists;
}

PointContent SemanticLayer::ContentAt(const Point& p) const {
  PointContent content;
  VisitBox({p, p}, [&](const ObjectPtr& object) {
    if (Covers(object->polygon, p)) content.objects.push_back(object);
  });
  std::sort(content.objects.begin(), content.objects.end(), ById);
  return content;
}

std::unique_ptr<AnswerCursor> SemanticLayer::ContentIn(const Polygon& area) const {
  std::vector<ObjectPtr> candidates;
  VisitBox(area.bounds(), [&](const ObjectPtr& object) { candidates.push_back(object); });
  return std::make_unique<ObjectCursor>(std::move(candidates), &area);
}

std::unique_ptr<AnswerCursor> SemanticLayer::Find(const ValueQuery& value,
                                                  const Polygon* area) const {
  const std::optional<Wanted> wanted = Translate(value);
  if (!wanted) return nullptr;
  std::vector<ObjectPtr> candidates;
  VisitMatches(*wanted, [&](const ObjectPtr& object) {
    if (!area || object->polygon.bounds().Intersects(area->bounds())) {
      candidates.push_back(object);
    }
  });
  return std::make_unique<ObjectCursor>(std::move(candidates), area);
}

std::optional<std::vector<Neighbour>> SemanticLayer::Nearest(const Point& p,
                                                             const ValueQuery& value, int k) const {
  const std::optional<Wanted> wanted = Translate(value);
  if (!wanted) return std::nullopt;
  NearestObjects nearest(p, k);
  size_t num_in_base = 0;
  for (const std::vector<int>* items : MatchesInBase(*wanted)) num_in_base += items->size();
  if (num_in_base <= kFewMatches) {
    VisitMatches(*wanted, [&](const ObjectPtr& object) { nearest.Offer(object); });
    return std::move(nearest).Take();
  }
  for (const auto& [id, object] : overlay_) {
    if (object && wanted->IsMetBy(*object)) nearest.Offer(object);
  }
  base_->by_box.VisitNearest(p, [&](int item, double distance_m) {
    if (nearest.IsClosedTo(distance_m)) return false;
    const ObjectPtr& object = base_->objects[item];
    if (!overlay_.contains(object->id) && wanted->IsMetBy(*object)) nearest.Offer(object);
    return true;
  });
  return std::move(nearest).Take();
}

}  // namespace hypermap
