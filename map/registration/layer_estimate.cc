#include "map/registration/layer_estimate.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/frames/planar_transform.h"
#include "map/layers/layer_spec.h"
#include "map/registration/grid_estimate.h"
#include "map/registration/object_estimate.h"

namespace hypermap::registration {
namespace {

// Returns frame_from_layer. `name` is that of the side in errors.
absl::StatusOr<PlanarTransform> FrameFromLayer(const PlacedLayer& side, const Layer& layer,
                                               absl::string_view name) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, side.snapshot->ResolveFrame(side.frame_id));
  const std::string& own = layer.spec().frame_id;
  absl::StatusOr<PlanarTransform> found = side.snapshot->frames.Lookup(frame, own);
  if (!absl::IsNotFound(found.status())) return found;
  return absl::FailedPreconditionError(
      absl::StrCat(name, ": layer \"", side.layer, "\" has the frame \"", own,
                   "\", which is not connected to \"", frame, "\""));
}

absl::StatusOr<TransformEstimate> EstimateInLayers(const PlacedLayer& source,
                                                   const PlacedLayer& target,
                                                   const LayerSpec& source_spec,
                                                   const LayerSpec& target_spec) {
  const bool same = source_spec.kind == target_spec.kind;
  if (same && source_spec.kind == LayerKind::kOccupancy) {
    return EstimateFromGrids(*source.snapshot->FindGrid(source.layer),
                             *target.snapshot->FindGrid(target.layer));
  }
  if (same && source_spec.kind == LayerKind::kSemantic) {
    return EstimateFromObjects(*source.snapshot->FindSemantic(source.layer),
                               *target.snapshot->FindSemantic(target.layer));
  }
  return absl::FailedPreconditionError(absl::StrCat(
      "layer \"", source.layer, "\" of the source is of the kind ", LayerKindName(source_spec.kind),
      " and layer \"", target.layer, "\" of the target of the kind ",
      LayerKindName(target_spec.kind), "; both must be occupancy, or both semantic"));
}

}  // namespace

absl::StatusOr<TransformEstimate> EstimateFromLayers(const PlacedLayer& source,
                                                     const PlacedLayer& target) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr source_layer, source.snapshot->GetLayer(source.layer));
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr target_layer, target.snapshot->GetLayer(target.layer));
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform source_from_layer,
                            FrameFromLayer(source, *source_layer, "source"));
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform target_from_layer,
                            FrameFromLayer(target, *target_layer, "target"));
  HYPERMAP_ASSIGN_OR_RETURN(
      TransformEstimate estimate,
      EstimateInLayers(source, target, source_layer->spec(), target_layer->spec()));
  return InFrames(std::move(estimate), target_from_layer, source_from_layer);
}

}  // namespace hypermap::registration
