#include "client_libs/cpp/replica/local_answers.h"

#include <optional>
#include <utility>

#include "base/limits/limits.h"

namespace hypermap::client {
namespace {

// Maximum number of objects or runs in a part, as the server's default.
constexpr int kPartItems = Limits().chunk_items;

void Move(const PlanarTransform& caller_from_layer, SemanticObject& object) {
  if (!caller_from_layer.IsIdentity()) object.shape = caller_from_layer * object.shape;
}

std::vector<SemanticObject> InFrame(const std::vector<ObjectPtr>& objects,
                                    const PlanarTransform& caller_from_layer) {
  std::vector<SemanticObject> moved;
  moved.reserve(objects.size());
  for (const ObjectPtr& object : objects) Move(caller_from_layer, moved.emplace_back(*object));
  return moved;
}

LayerPart ToPart(LayerAnswerPart part) {
  const LayerSpec& spec = part.layer->spec();
  LayerPart answer{.layer = spec.name, .kind = spec.kind, .status = part.status};
  if (part.status != AnswerStatus::kValue) return answer;
  answer.objects = InFrame(part.part.objects, part.caller_from_layer);
  if (spec.grid) answer.grid = GeometryInFrame(*spec.grid, part.caller_from_layer);
  answer.runs = std::move(part.part.runs);
  return answer;
}

NearestMatch ToMatch(const NearestNeighbours::Entry& entry) {
  const LayerSpec& spec = entry.layer->spec();
  NearestMatch match{
      .layer = spec.name, .kind = spec.kind, .distance_m = entry.neighbour.distance_m};
  if (entry.neighbour.object) {
    Move(entry.caller_from_layer, match.object.emplace(*entry.neighbour.object));
  } else if (spec.grid) {
    match.grid = GeometryInFrame(*spec.grid, entry.caller_from_layer);
    match.cell = entry.neighbour.cell;
  }
  return match;
}

// Gives the same parts as the server, see EmptyPartFilter.
class LocalParts : public PartStream<AnswerReader::RevisedPart> {
 public:
  LocalParts(std::unique_ptr<PartReader> parts, Revision revision, uint64_t incarnation)
      : parts_(std::move(parts)), revision_(revision), incarnation_(incarnation) {}

  std::optional<AnswerReader::RevisedPart> Next() override {
    while (!parts_->done()) {
      LayerAnswerPart part = parts_->Next(kPartItems);
      if (!filter_.Keeps(part)) continue;
      return AnswerReader::RevisedPart{revision_, ToPart(std::move(part)), incarnation_};
    }
    if (std::exchange(ended_, true)) return std::nullopt;
    // Carries the revision to the reader even if no layer was queried.
    return AnswerReader::RevisedPart{revision_, std::nullopt, incarnation_};
  }

  const absl::Status& status() const override { return status_; }

 private:
  const std::unique_ptr<PartReader> parts_;
  const Revision revision_;
  const uint64_t incarnation_;
  EmptyPartFilter filter_;
  bool ended_ = false;
  const absl::Status status_;
};

class NoParts : public PartStream<AnswerReader::RevisedPart> {
 public:
  explicit NoParts(absl::Status why) : why_(std::move(why)) {}

  std::optional<AnswerReader::RevisedPart> Next() override { return std::nullopt; }
  const absl::Status& status() const override { return why_; }

 private:
  const absl::Status why_;
};

}  // namespace

LayerContent ToContent(const Layer& layer, const PlanarTransform& caller_from_layer,
                       const PointContent& content) {
  return {.layer = layer.spec().name,
          .kind = layer.spec().kind,
          .status = content.status,
          .value = content.value,
          .objects = InFrame(content.objects, caller_from_layer)};
}

PointsAnswer ToPointsAnswer(SnapshotPtr snapshot, uint64_t incarnation, size_t num_points,
                            absl::Span<const LayerPointsContent> contents) {
  PointsAnswer answer{.revision = snapshot->revision, .num_points = num_points};
  for (const LayerPointsContent& content : contents) {
    const LayerSpec& spec = content.layer->spec();
    LayerPoints& layer = answer.layers.emplace_back();
    layer.layer = spec.name;
    layer.kind = spec.kind;
    layer.status = content.status;
    layer.statuses = content.content.statuses;
    layer.values = content.content.values;
    layer.hits.reserve(content.content.hits.size());
    for (const PointsContent::Hit& hit : content.content.hits) {
      layer.hits.push_back({hit.point, hit.object->id, hit.object->label,
                            static_cast<float>(hit.object->existence)});
    }
  }
  answer.labels_in = std::move(snapshot);
  answer.incarnation = incarnation;
  return answer;
}

NearestAnswer ToNearestAnswer(const NearestNeighbours& answer) {
  NearestAnswer converted;
  converted.matches.reserve(answer.entries.size());
  for (const auto& entry : answer.entries) converted.matches.push_back(ToMatch(entry));
  converted.refusals = answer.refusals;
  return converted;
}

AnswerReader ReadLocally(std::unique_ptr<PartReader> parts, Revision revision,
                         uint64_t incarnation) {
  return AnswerReader(std::make_unique<LocalParts>(std::move(parts), revision, incarnation));
}

AnswerReader FailLocally(absl::Status why) {
  return AnswerReader(std::make_unique<NoParts>(std::move(why)));
}

}  // namespace hypermap::client
