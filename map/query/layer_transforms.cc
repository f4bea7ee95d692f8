#include "map/query/layer_transforms.h"

#include <algorithm>
#include <limits>

#include "base/cancellation/cancellation.h"

namespace hypermap {

std::optional<PlanarTransform> LayerTransforms::CallerFromLayer(const Layer& layer) {
  const LayerSpec& spec = layer.spec();
  if (spec.grid && !IsWithinBounds(spec.grid->layer_from_grid)) return std::nullopt;
  if (spec.frame_id == caller_frame_id_) return PlanarTransform();
  const auto [found, is_new] = found_.try_emplace(spec.frame_id);
  if (is_new) {
    const auto transform = snapshot_->frames.Lookup(caller_frame_id_, spec.frame_id);
    if (transform.ok()) found->second = *transform;
  }
  return found->second;
}

absl::Status LayerTransforms::Prepare(const Layer& layer) {
  const std::string& frame_id = layer.spec().frame_id;
  if (frame_id == caller_frame_id_ || found_.contains(frame_id)) return absl::OkStatus();
  CallerFromLayer(layer);
  return CheckCancelled();
}

Point InLayer(const PlanarTransform& layer_from_caller, const Point& p) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  const Point in_layer = layer_from_caller * p;
  return {std::clamp(in_layer.x, -kLargest, kLargest), std::clamp(in_layer.y, -kLargest, kLargest)};
}

}  // namespace hypermap
