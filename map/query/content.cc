#include <utility>

#include "absl/strings/str_cat.h"
#include "map/query/query.h"

namespace hypermap {

absl::StatusOr<std::vector<LayerContent>> ContentAt(const Snapshot& snapshot, const Scope& scope,
                                                    const Point& p) {
  if (!IsFinite(p)) return absl::InvalidArgumentError("point is not finite");
  absl::StatusOr<std::string> caller = snapshot.ResolveFrame(scope.frame_id);
  if (!caller.ok()) return caller.status();
  absl::StatusOr<std::vector<LayerPtr>> layers = snapshot.SelectLayers(scope.layers);
  if (!layers.ok()) return layers.status();

  std::vector<LayerContent> contents;
  contents.reserve(layers->size());
  for (LayerPtr& layer : *layers) {
    LayerContent answer;
    const auto caller_from_layer = snapshot.frames.Lookup(*caller, layer->spec().frame_id);
    if (caller_from_layer.ok()) {
      answer.caller_from_layer = *caller_from_layer;
      answer.content = layer->ContentAt(caller_from_layer->Inverse() * p);
    } else {
      answer.content.status = AnswerStatus::kNoTransform;
    }
    answer.layer = std::move(layer);
    contents.push_back(std::move(answer));
  }
  return contents;
}

absl::StatusOr<PointsAsker> PointsAsker::Make(SnapshotPtr snapshot, const Scope& scope) {
  PointsAsker asker;
  absl::StatusOr<std::string> caller = snapshot->ResolveFrame(scope.frame_id);
  if (!caller.ok()) return caller.status();
  absl::StatusOr<std::vector<LayerPtr>> layers = snapshot->SelectLayers(scope.layers);
  if (!layers.ok()) return layers.status();
  for (LayerPtr& layer : *layers) {
    AskedLayer asked;
    LayerPointsContent answer;
    const auto caller_from_layer = snapshot->frames.Lookup(*caller, layer->spec().frame_id);
    if (caller_from_layer.ok()) {
      asked.layer_from_caller = caller_from_layer->Inverse();
      asked.is_same_frame = layer->spec().frame_id == *caller;
    } else {
      answer.status = AnswerStatus::kNoTransform;
    }
    answer.layer = std::move(layer);
    asker.asked_.push_back(asked);
    asker.answers_.push_back(std::move(answer));
  }
  asker.frame_id_ = *std::move(caller);
  asker.snapshot_ = std::move(snapshot);
  return asker;
}

absl::StatusOr<absl::Span<const LayerPointsContent>> PointsAsker::ContentAtEach(
    absl::Span<const Point> points) {
  for (size_t i = 0; i < points.size(); ++i) {
    if (IsFinite(points[i])) continue;
    return absl::InvalidArgumentError(absl::StrCat("points[", i, "] is not finite"));
  }
  for (size_t i = 0; i < answers_.size(); ++i) {
    LayerPointsContent& answer = answers_[i];
    if (answer.status != AnswerStatus::kValue) continue;
    if (asked_[i].is_same_frame) {
      answer.layer->ContentAtEach(points, &answer.content);
      continue;
    }
    in_layer_.clear();
    for (const Point& p : points) in_layer_.push_back(asked_[i].layer_from_caller * p);
    answer.layer->ContentAtEach(in_layer_, &answer.content);
  }
  return answers_;
}

GridGeometry GeometryInFrame(const GridGeometry& geometry,
                             const PlanarTransform& caller_from_layer) {
  return {caller_from_layer * geometry.layer_from_grid, geometry.resolution_m};
}

}  // namespace hypermap
