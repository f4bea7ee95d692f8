#include <utility>

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

GridGeometry GeometryInFrame(const GridGeometry& geometry,
                             const PlanarTransform& caller_from_layer) {
  return {caller_from_layer * geometry.layer_from_grid, geometry.resolution_m};
}

}  // namespace hypermap
