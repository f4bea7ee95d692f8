#include "map/layers/semantic_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "base/cancellation/cancellable_sort.h"
#include "base/cancellation/cancellation.h"
#include "base/cancellation/give_way.h"
#include "map/geometry/predicates.h"
#include "map/objects/prefetch.h"

namespace hypermap {
namespace {

// Number of objects that a part tests at most, so that the caller can check for cancellation.
constexpr size_t kTestsPerPart = 4096;

// Returns the candidates by id: those that intersect an area exactly, or all of them.
class ObjectCursor : public AnswerCursor {
 public:
  ObjectCursor(std::shared_ptr<const ObjectIndex> index, const Polygon* area)
      : index_(std::move(index)) {
    if (area) area_.emplace(*area);
  }

  void Offer(const ObjectPtr& object) { candidates_.push_back({object->id, &object}); }
  // Must be called after the last Offer and before Next.
  void Sort() {
    CancellableSort(candidates_.begin(), candidates_.end(),
                    [](const Candidate& a, const Candidate& b) { return a.id < b.id; });
  }

  AnswerPart Next(int max_items) override {
    AnswerPart part;
    const size_t stop = std::min(candidates_.size(), next_ + kTestsPerPart);
    part.objects.reserve(std::min(stop - next_, static_cast<size_t>(max_items)));
    while (next_ < stop && part.objects.size() < static_cast<size_t>(max_items)) {
      // Each test takes long if the area and the objects have many vertices.
      if (area_ && IsCancelled()) break;
      const ObjectPtr& object = *candidates_[next_++].place;
      if (!area_ || area_->Intersects(object->shape)) part.objects.push_back(object);
    }
    return part;
  }

  bool done() const override { return next_ == candidates_.size(); }

 private:
  struct Candidate {
    ObjectId id;
    const ObjectPtr* place;  // In the index.
  };

  std::shared_ptr<const ObjectIndex> index_;
  std::vector<Candidate> candidates_;
  std::optional<PreparedPolygon> area_;
  size_t next_ = 0;
};

// Keeps the k nearest of the offered objects. Measures them in groups, so that their waits for
// memory overlap: each object takes three dependent reads.
class NearestObjects {
 public:
  NearestObjects(const Point& p, int k)
      : p_(p),
        k_(static_cast<size_t>(k)),
        group_(std::min<size_t>(std::max(k_, kMinGroup), kMaxGroup)) {}

  // Returns the distance beyond which an object cannot be among the k nearest. Keeps a pointer to
  // `object` until Take.
  double Offer(const ObjectPtr& object) {
    __builtin_prefetch(&object);
    offered_.push_back(&object);
    if (offered_.size() == group_) Measure();
    if (++num_offered_ % kOffersPerLook == 0 && IsCancelled()) is_cancelled_ = true;
    if (is_cancelled_) {
      offered_.clear();
      return 0.0;
    }
    return Limit();
  }

  std::vector<Neighbour> Take() && {
    Measure();
    std::vector<Neighbour> result(best_.size());
    for (size_t i = result.size(); i-- > 0; best_.pop()) {
      result[i].distance_m = best_.top().distance_m;
      result[i].object = *best_.top().place;
    }
    return result;
  }

 private:
  struct Found {
    double distance_m;
    ObjectId id;
    const ObjectPtr* place;
    bool operator<(const Found& other) const {
      return std::pair(distance_m, id) < std::pair(other.distance_m, other.id);
    }
  };

  static constexpr size_t kOffersPerLook = 64;
  static constexpr size_t kMinGroup = 4;
  static constexpr size_t kMaxGroup = 16;

  double Limit() const {
    return best_.size() == k_ ? best_.top().distance_m : std::numeric_limits<double>::infinity();
  }

  void Measure() {
    // The whole object, since most of those measured are returned and read by the caller.
    for (const ObjectPtr* place : offered_) PrefetchObject(**place);
    for (const ObjectPtr* place : offered_) PrefetchVertices((*place)->shape);
    for (const ObjectPtr* place : offered_) {
      const Found found{Distance((*place)->shape, p_), (*place)->id, place};
      if (best_.size() == k_) {
        if (!(found < best_.top())) continue;
        best_.pop();
      }
      best_.push(found);
    }
    offered_.clear();
  }

  Point p_;
  size_t k_;
  size_t group_;
  size_t num_offered_ = 0;
  bool is_cancelled_ = false;
  absl::InlinedVector<const ObjectPtr*, kMaxGroup> offered_;
  std::priority_queue<Found, absl::InlinedVector<Found, kMaxGroup>> best_;  // Farthest first.
};

// Appends to the hits. Copies them in pieces when they need more memory, because a copy of
// megabytes would hold other threads up.
void Append(const PointsContent::Hit& hit, std::vector<PointsContent::Hit>* hits) {
  constexpr size_t kPiece = 8192;
  if (hits->size() == hits->capacity() && hits->size() >= kPiece) {
    std::vector<PointsContent::Hit> larger;
    larger.reserve(2 * hits->size());
    for (size_t i = 0; i < hits->size(); i += kPiece) {
      const auto piece = hits->begin() + static_cast<ptrdiff_t>(i);
      larger.insert(larger.end(), piece,
                    piece + static_cast<ptrdiff_t>(std::min(kPiece, hits->size() - i)));
      GiveWay();
    }
    hits->swap(larger);
  }
  hits->push_back(hit);
}

}  // namespace

SemanticLayer::SemanticLayer(LayerSpec spec) : SemanticLayer(std::move(spec), {}) {}

SemanticLayer::SemanticLayer(LayerSpec spec, std::vector<ObjectPtr> objects)
    : Layer(std::move(spec)),
      index_(std::make_shared<const ObjectIndex>(std::move(objects))),
      bytes_of_aliases_(UnsharedBytes(this->spec().aliases, {})) {}

SemanticLayer::SemanticLayer(LayerSpec spec, std::shared_ptr<const ObjectIndex> index,
                             int64_t bytes_of_aliases)
    : Layer(std::move(spec)), index_(std::move(index)), bytes_of_aliases_(bytes_of_aliases) {}

std::shared_ptr<const SemanticLayer> SemanticLayer::With(
    const absl::btree_map<ObjectId, ObjectPtr>& changes) const {
  return std::shared_ptr<const SemanticLayer>(new SemanticLayer(
      spec(), std::make_shared<const ObjectIndex>(index_->With(changes)), bytes_of_aliases_));
}

std::shared_ptr<const SemanticLayer> SemanticLayer::WithAliases(ValueAliases aliases) const {
  LayerSpec spec = this->spec();
  // Without what the two share, so that the cost is that of the change.
  const int64_t bytes_of_aliases = bytes_of_aliases_ + UnsharedBytes(aliases, spec.aliases) -
                                   UnsharedBytes(spec.aliases, aliases);
  spec.aliases = std::move(aliases);
  return std::shared_ptr<const SemanticLayer>(
      new SemanticLayer(std::move(spec), index_, bytes_of_aliases));
}

ObjectPtr SemanticLayer::Find(ObjectId id) const {
  const ObjectPtr* const object = index_->Find(id);
  return object ? *object : nullptr;
}

std::optional<SemanticLayer::Wanted> SemanticLayer::Translate(const ValueQuery& value) const {
  if (const auto* label = std::get_if<ValueLabel>(&value)) {
    return Wanted{ObjectIndex::WordKind::kLabel, LabelsFor(spec().aliases, label->label)};
  }
  if (const auto* tag = std::get_if<ValueTag>(&value)) {
    return Wanted{ObjectIndex::WordKind::kTag, {tag->tag}};
  }
  return std::nullopt;
}

void SemanticLayer::VisitWithin(const Point& p, double tolerance_m, ObjectVisitor visit) const {
  // Widens the box so that rounding of its sides leaves out no object.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto below = [](double v) { return std::nextafter(v, -kInfinity); };
  const auto above = [](double v) { return std::nextafter(v, kInfinity); };
  const Box box{{below(p.x - tolerance_m), below(p.y - tolerance_m)},
                {above(p.x + tolerance_m), above(p.y + tolerance_m)}};
  std::vector<const ObjectPtr*> found;
  index_->VisitBox(box, [&](const ObjectPtr& object) {
    if (Distance(object->shape, p) <= tolerance_m) found.push_back(&object);
  });
  CancellableSort(found.begin(), found.end(),
                  [](const ObjectPtr* a, const ObjectPtr* b) { return (*a)->id < (*b)->id; });
  for (const ObjectPtr* object : found) visit(*object);
}

PointContent SemanticLayer::ContentAt(const Point& p, double tolerance_m) const {
  PointContent content;
  if (tolerance_m > 0.0) {
    VisitWithin(p, tolerance_m,
                [&content](const ObjectPtr& object) { content.objects.push_back(object); });
    return content;
  }
  index_->CoverEach({&p, 1}, [&content](uint32_t /*point*/, const ObjectPtr& object) {
    content.objects.push_back(object);
    return true;
  });
  return content;
}

void SemanticLayer::ContentAtEach(absl::Span<const Point> points, double tolerance_m,
                                  PointsContent* content) const {
  content->Clear();
  const auto has_room = [content] { return content->hits.size() <= content->max_hits; };
  if (tolerance_m == 0.0) {
    index_->CoverEach(points, [&](uint32_t point, const ObjectPtr& object) {
      Append({point, object.get()}, &content->hits);
      return has_room();
    });
    return;
  }
  for (size_t i = 0; i < points.size() && has_room() && !IsCancelled(); ++i) {
    VisitWithin(points[i], tolerance_m, [&](const ObjectPtr& object) {
      if (has_room()) Append({static_cast<uint32_t>(i), object.get()}, &content->hits);
    });
  }
}

std::unique_ptr<AnswerCursor> SemanticLayer::ContentIn(const Polygon& area) const {
  auto cursor = std::make_unique<ObjectCursor>(index_, &area);
  index_->VisitBox(area.bounds(), [&](const ObjectPtr& object) { cursor->Offer(object); });
  cursor->Sort();
  return cursor;
}

std::unique_ptr<AnswerCursor> SemanticLayer::Find(const ValueQuery& value,
                                                  const Polygon* area) const {
  const std::optional<Wanted> wanted = Translate(value);
  if (!wanted) return nullptr;
  auto cursor = std::make_unique<ObjectCursor>(index_, area);
  for (const std::string& word : wanted->words) {
    index_->VisitWord(wanted->kind, word, area ? &area->bounds() : nullptr,
                      [&](const ObjectPtr& object) { cursor->Offer(object); });
  }
  cursor->Sort();
  return cursor;
}

std::optional<std::vector<Neighbour>> SemanticLayer::Nearest(const Point& p,
                                                             const ValueQuery& value, int k) const {
  const std::optional<Wanted> wanted = Translate(value);
  if (!wanted) return std::nullopt;
  NearestObjects nearest(p, k);
  for (const std::string& word : wanted->words) {
    index_->VisitNearest(
        wanted->kind, word, p,
        [&](const ObjectPtr& object, double /*at_least_m*/) { return nearest.Offer(object); });
  }
  return std::move(nearest).Take();
}

const SemanticLayer* AsSemantic(const Layer* layer) {
  return dynamic_cast<const SemanticLayer*>(layer);
}

std::shared_ptr<const SemanticLayer> AsSemantic(const LayerPtr& layer) {
  return std::dynamic_pointer_cast<const SemanticLayer>(layer);
}

}  // namespace hypermap
