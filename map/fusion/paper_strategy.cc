#include "map/fusion/paper_strategy.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "map/fusion/parameters.h"
#include "map/fusion/state_codec.h"
#include "map/fusion/track_index.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "map/geometry/predicates.h"

namespace hypermap::fusion {
namespace {

constexpr int kStateVersion = 1;

// The defaults are those of the paper: it shows every object, and its counters have no bound.
struct PaperParameters {
  double jaccard = 0.2;
  double publish_count = 1.0;
  double max_count = 1e6;
};

struct PaperObject {
  TrackKey key;
  std::string label;
  double count = 0.0;
  std::vector<Polygon> seen;
  std::vector<Point> centroids;
  double score_sum = 0.0;
  HeightRange height;
  ObjectPtr pinned;      // Set if an operator put it.
  bool removed = false;  // By an operator: absorbs detections, not shown.
  // Derived from the members above.
  Polygon shape;
  ObjectPtr object;

  void Refresh(const PaperParameters& parameters);
};
using PaperObjectPtr = std::shared_ptr<const PaperObject>;

void PaperObject::Refresh(const PaperParameters& parameters) {
  object = pinned;
  if (pinned) shape = FootprintOf(pinned->shape, kPinHalfWidth_m);
  if (pinned || seen.empty()) return;
  Point mean;
  for (const Point& c : centroids) {
    mean.x += c.x / static_cast<double>(centroids.size());
    mean.y += c.y / static_cast<double>(centroids.size());
  }
  size_t best = 0;
  for (size_t i = 1; i < centroids.size(); ++i) {
    const auto off = [&](size_t k) {
      return std::hypot(centroids[k].x - mean.x, centroids[k].y - mean.y);
    };
    if (off(i) < off(best)) best = i;
  }
  shape = seen[best];
  if (removed || count < parameters.publish_count) return;
  auto shown = std::make_shared<SemanticObject>();
  shown->label = label;
  shown->classes[label] = score_sum / static_cast<double>(seen.size());
  // The rule has a counter and no probability; this maps the counter to [0, 1).
  shown->existence = 1.0 - std::exp2(-count);
  shown->shape = shape;
  shown->height = height;
  shown->attributes["observations"] = static_cast<int64_t>(seen.size());
  object = std::move(shown);
}

// Bytes of the object that is shown, besides its shape.
constexpr int64_t kBytesOfObject = 1024;

int64_t BytesOf(const Polygon& polygon) {
  return static_cast<int64_t>(sizeof(polygon) + sizeof(Ring) * polygon.rings().size() +
                              sizeof(Point) * static_cast<size_t>(polygon.num_vertices()));
}

int64_t BytesOf(const PaperObject& object) {
  int64_t bytes = static_cast<int64_t>(sizeof(object)) + kBytesOfObject + BytesOf(object.shape);
  for (const Polygon& polygon : object.seen) {
    bytes += BytesOf(polygon) + static_cast<int64_t>(sizeof(Point));
  }
  return bytes;
}

class PaperState : public State {
 public:
  std::vector<PaperObjectPtr> objects;
};

// A fact applies to the object that it names; failing that, to the object of its label with the
// greatest Jaccard index, if that is high enough for the rule; failing that, to a new object.
class PaperFacts : public FactFold {
 public:
  PaperFacts(const PaperState& before, const PaperParameters& parameters)
      : parameters_(parameters), after_(std::make_shared<PaperState>(before)) {
    index_.Reserve(after_->objects.size());
    for (const PaperObjectPtr& object : after_->objects) {
      index_.Add(object->key, object->shape.bounds());
    }
  }

  void Add(const OperatorFact& fact) override;
  StatePtr Finish() override { return std::move(after_); }

 private:
  const PaperParameters parameters_;
  std::shared_ptr<PaperState> after_;
  TrackIndex index_;  // Finds after_->objects by shape.
};

void PaperFacts::Add(const OperatorFact& fact) {
  std::vector<PaperObjectPtr>& objects = after_->objects;
  const Polygon footprint = FootprintOf(fact.object.shape, kPinHalfWidth_m);
  const std::optional<size_t> found =
      index_.Find(fact.track, footprint.bounds(), parameters_.jaccard, [&](size_t k) {
        if (objects[k]->label != fact.object.label) return 0.0;
        return Iou(objects[k]->shape, footprint);
      });
  auto object = std::make_shared<PaperObject>();
  if (found) {
    *object = *objects[*found];
  } else {
    object->key = fact.track;
    object->count = 1.0;
    object->shape = footprint;
  }
  object->label = fact.object.label;
  object->removed = fact.kind == OperatorFact::Kind::kRemove;
  object->pinned = nullptr;
  if (!object->removed) {
    auto pinned = std::make_shared<SemanticObject>(fact.object);
    pinned->id = 0;
    object->pinned = std::move(pinned);
  }
  object->Refresh(parameters_);
  if (found) {
    index_.Move(*found, object->shape.bounds());
    objects[*found] = std::move(object);
  } else {
    index_.Add(object->key, object->shape.bounds());
    objects.push_back(std::move(object));
  }
}

class PaperStrategy : public Strategy {
 public:
  explicit PaperStrategy(const PaperParameters& parameters) : parameters_(parameters) {}

  absl::string_view name() const override { return "paper"; }
  StatePtr Initial() const override { return std::make_shared<PaperState>(); }
  StatePtr Fold(const StatePtr& state, const Observation& observation,
                FoldReport* report) const override;
  std::unique_ptr<FactFold> FoldFacts(const StatePtr& state) const override {
    return std::make_unique<PaperFacts>(static_cast<const PaperState&>(*state), parameters_);
  }
  std::vector<FusedObject> Objects(const StatePtr& state) const override;
  int64_t ByteSize(const StatePtr& state, const StatePtr& older) const override;
  int64_t MostGrowth(const Observation& observation) const override;
  std::string Encode(const StatePtr& state) const override;
  absl::StatusOr<StatePtr> Decode(absl::string_view bytes) const override;

 private:
  const PaperParameters parameters_;
};

StatePtr PaperStrategy::Fold(const StatePtr& state, const Observation& observation,
                             FoldReport* report) const {
  auto after = std::make_shared<PaperState>(static_cast<const PaperState&>(*state));
  std::vector<uint8_t> hit(after->objects.size(), 0);
  // One after another: the rule does not forbid two detections of a frame to belong to one object.
  for (size_t i = 0; i < observation.detections.size(); ++i) {
    const Detection& detection = observation.detections[i];
    const auto label =
        std::max_element(detection.scores.begin(), detection.scores.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    size_t best = after->objects.size();
    double best_jaccard = parameters_.jaccard;
    for (size_t k = 0; k < after->objects.size(); ++k) {
      const PaperObject& object = *after->objects[k];
      if (object.label != label->first ||
          !object.shape.bounds().Intersects(detection.hull.bounds())) {
        continue;
      }
      const double jaccard = Iou(object.shape, detection.hull);
      if (jaccard >= best_jaccard) {
        best_jaccard = jaccard;
        best = k;
      }
    }
    auto object = std::make_shared<PaperObject>();
    if (best < after->objects.size()) {
      *object = *after->objects[best];
    } else {
      object->key = absl::StrCat(observation.robot, "/", observation.sequence, "/", i);
      object->label = label->first;
      object->height = detection.height;
      best_jaccard = 1.0;
    }
    object->count = std::min(parameters_.max_count, object->count + 1.0);
    object->seen.push_back(detection.hull);
    object->centroids.push_back(Centroid(detection.hull));
    object->score_sum += label->second;
    object->height.low_m = std::min(object->height.low_m, detection.height.low_m);
    object->height.high_m = std::max(object->height.high_m, detection.height.high_m);
    object->Refresh(parameters_);
    if (report) {
      report->associations.push_back({static_cast<int>(i), object->key, best_jaccard});
      report->existence[object->key] = 1.0 - std::exp2(-object->count);
    }
    if (best < after->objects.size()) {
      after->objects[best] = std::move(object);
      hit[best] = 1;
    } else {
      after->objects.push_back(std::move(object));
      hit.push_back(1);
    }
  }
  if (!observation.view_hull.empty()) {
    const PreparedPolygon view(observation.view_hull);
    for (size_t k = 0; k < after->objects.size(); ++k) {
      // An object must be in the view as a whole. One that the border cuts off may have been
      // missed.
      if (hit[k] || after->objects[k]->pinned ||
          !after->objects[k]->shape.bounds().Intersects(observation.view_hull.bounds()) ||
          !view.Covers(after->objects[k]->shape)) {
        continue;
      }
      auto object = std::make_shared<PaperObject>(*after->objects[k]);
      object->count -= 1.0;
      object->Refresh(parameters_);
      if (report) {
        report->missed.push_back(object->key);
        report->existence[object->key] =
            object->count > 0.0 ? 1.0 - std::exp2(-object->count) : 0.0;
      }
      after->objects[k] = object->count > 0.0 ? std::move(object) : nullptr;
    }
    std::erase(after->objects, nullptr);
  }
  return after;
}

int64_t PaperStrategy::ByteSize(const StatePtr& state, const StatePtr& older) const {
  absl::flat_hash_set<const PaperObject*> shared;
  if (older) {
    for (const PaperObjectPtr& object : static_cast<const PaperState&>(*older).objects) {
      shared.insert(object.get());
    }
  }
  int64_t bytes = sizeof(PaperState);
  for (const PaperObjectPtr& object : static_cast<const PaperState&>(*state).objects) {
    bytes += sizeof(PaperObjectPtr);
    if (!shared.contains(object.get())) bytes += BytesOf(*object);
  }
  return bytes;
}

int64_t PaperStrategy::MostGrowth(const Observation& observation) const {
  int64_t bytes = 0;
  for (const Detection& detection : observation.detections) {
    // A copy of the hull is its object's shape, too.
    bytes +=
        static_cast<int64_t>(sizeof(PaperObject)) + kBytesOfObject + 3 * BytesOf(detection.hull);
  }
  return bytes;
}

std::string PaperStrategy::Encode(const StatePtr& state) const {
  nlohmann::json objects = nlohmann::json::array();
  for (const PaperObjectPtr& object : static_cast<const PaperState&>(*state).objects) {
    nlohmann::json seen = nlohmann::json::array();
    for (const Polygon& polygon : object->seen) seen.push_back(EncodePolygon(polygon));
    nlohmann::json encoded = {{"key", object->key},
                              {"label", object->label},
                              {"count", object->count},
                              {"seen", std::move(seen)},
                              {"score_sum", object->score_sum},
                              {"height", {object->height.low_m, object->height.high_m}},
                              {"removed", object->removed},
                              {"shape", EncodePolygon(object->shape)}};
    if (object->pinned) encoded["pinned"] = EncodeObject(*object->pinned);
    objects.push_back(std::move(encoded));
  }
  return EncodeState(name(), kStateVersion, std::move(objects));
}

absl::StatusOr<StatePtr> PaperStrategy::Decode(absl::string_view bytes) const {
  auto state = std::make_shared<PaperState>();
  const auto status = DecodeState(name(), kStateVersion, bytes, [&](const nlohmann::json& objects) {
    for (const nlohmann::json& encoded : objects) {
      auto object = std::make_shared<PaperObject>();
      encoded.at("key").get_to(object->key);
      encoded.at("label").get_to(object->label);
      encoded.at("count").get_to(object->count);
      for (const nlohmann::json& polygon : encoded.at("seen")) {
        object->seen.push_back(DecodePolygon(polygon));
        object->centroids.push_back(Centroid(object->seen.back()));
      }
      encoded.at("score_sum").get_to(object->score_sum);
      object->height = {encoded.at("height").at(0).get<double>(),
                        encoded.at("height").at(1).get<double>()};
      encoded.at("removed").get_to(object->removed);
      object->shape = DecodePolygon(encoded.at("shape"));
      if (encoded.contains("pinned")) {
        object->pinned = std::make_shared<SemanticObject>(DecodeObject(encoded["pinned"]));
      }
      object->Refresh(parameters_);
      state->objects.push_back(std::move(object));
    }
  });
  if (!status.ok()) return status;
  return StatePtr(std::move(state));
}

std::vector<FusedObject> PaperStrategy::Objects(const StatePtr& state) const {
  std::vector<FusedObject> objects;
  for (const PaperObjectPtr& object : static_cast<const PaperState&>(*state).objects) {
    if (object->object) objects.push_back({object->key, object->object});
  }
  std::sort(objects.begin(), objects.end(),
            [](const FusedObject& a, const FusedObject& b) { return a.track < b.track; });
  return objects;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Strategy>> MakePaperStrategy(absl::string_view parameters) {
  PaperParameters parsed;
  const auto status =
      SetParameters(parameters, {{"jaccard", &parsed.jaccard, 0.01, 1.0},
                                 {"publish_count", &parsed.publish_count, 1.0, 1000.0},
                                 {"max_count", &parsed.max_count, 1.0, 1e6}});
  if (!status.ok()) return status;
  return std::make_unique<PaperStrategy>(parsed);
}

}  // namespace hypermap::fusion
