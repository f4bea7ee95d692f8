#include "server/exploration/exploration_start.h"

#include <cmath>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_spec.h"

namespace hypermap::server {
namespace {

absl::Status CheckStart(const ExplorationStart& request) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("occupancy_layer", request.occupancy_layer));
  HYPERMAP_RETURN_IF_ERROR(ValidateName("exploration_layer", request.exploration_layer));
  if (request.exploration_layer == kExplorationsLayer) {
    return absl::InvalidArgumentError(absl::StrCat("exploration_layer: \"", kExplorationsLayer,
                                                   "\" keeps the explorations themselves"));
  }
  // Written so that NaN fails.
  if (!(request.robot_radius_m >= 0.0 && request.robot_radius_m <= kMaxRobotRadius_m)) {
    return absl::InvalidArgumentError(
        absl::StrCat("robot_radius_m must lie in [0, ", kMaxRobotRadius_m, "]"));
  }
  if (!(request.range_m > 0.0 && request.range_m <= kMaxRange_m)) {
    return absl::InvalidArgumentError(absl::StrCat("range_m must lie in (0, ", kMaxRange_m, "]"));
  }
  if (request.min_gain_cells < 1) {
    return absl::InvalidArgumentError("min_gain_cells must be positive");
  }
  return absl::OkStatus();
}

// Adds an edit that creates the layer if there is none of its name. FAILED_PRECONDITION if there is
// one of another kind; DATA_LOSS if it is damaged.
absl::Status EnsureLayer(const Snapshot& snapshot, const LayerSpec& spec,
                         std::vector<Edit>* edits) {
  HYPERMAP_RETURN_IF_ERROR(snapshot.CheckUndamaged({spec.name}));
  const Layer* layer = snapshot.FindLayer(spec.name);
  if (layer != nullptr) return CheckKind(layer->spec(), spec.kind);
  edits->push_back(CreateLayer{spec});
  return absl::OkStatus();
}

LayerSpec ExplorationLayerOf(const ExplorationStart& request, const LayerSpec& occupancy) {
  LayerSpec spec;
  spec.name = request.exploration_layer;
  spec.kind = LayerKind::kExploration;
  spec.frame_id = occupancy.frame_id;
  spec.grid = occupancy.grid;
  spec.explored_rule = request.explored_rule;
  return spec;
}

LayerSpec LayerOfExplorations(const Snapshot& snapshot) {
  LayerSpec spec;
  spec.name = kExplorationsLayer;
  spec.kind = LayerKind::kSemantic;
  spec.frame_id = snapshot.frame_id;
  return spec;
}

Exploration ExplorationOf(const ExplorationStart& request, absl::Time now) {
  Exploration exploration;
  exploration.area = request.area;
  exploration.occupancy_layer = request.occupancy_layer;
  exploration.exploration_layer = request.exploration_layer;
  exploration.robot_radius_m = request.robot_radius_m;
  exploration.range_m = request.range_m;
  exploration.min_gain_cells = request.min_gain_cells;
  exploration.started = now;
  return exploration;
}

}  // namespace

absl::StatusOr<EditBatch> StartBatch(const Snapshot& snapshot, const ExplorationStart& request,
                                     absl::Time now) {
  HYPERMAP_RETURN_IF_ERROR(CheckStart(request));
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr occupancy, snapshot.GetLayer(request.occupancy_layer));
  const LayerSpec& occupancy_spec = occupancy->spec();
  HYPERMAP_RETURN_IF_ERROR(CheckKind(occupancy_spec, LayerKind::kOccupancy));
  EditBatch batch;
  batch.time = now;
  absl::Status status =
      EnsureLayer(snapshot, ExplorationLayerOf(request, occupancy_spec), &batch.edits);
  if (status.ok()) status = EnsureLayer(snapshot, LayerOfExplorations(snapshot), &batch.edits);
  HYPERMAP_RETURN_IF_ERROR(status);
  HYPERMAP_ASSIGN_OR_RETURN(std::string frame, snapshot.ResolveFrame(request.frame_id));
  batch.edits.push_back(
      PutObject{kExplorationsLayer, ToObject(ExplorationOf(request, now)), std::move(frame)});
  return batch;
}

}  // namespace hypermap::server
