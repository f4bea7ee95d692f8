#include "server/exploration/exploration_start.h"

#include <cmath>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "map/layers/layer_spec.h"

namespace hypermap::server {
namespace {

absl::Status CheckOrder(const StartOrder& order) {
  if (auto status = ValidateName("occupancy_layer", order.occupancy_layer); !status.ok()) {
    return status;
  }
  if (auto status = ValidateName("exploration_layer", order.exploration_layer); !status.ok()) {
    return status;
  }
  if (order.exploration_layer == kExplorationsLayer) {
    return absl::InvalidArgumentError(absl::StrCat("exploration_layer: \"", kExplorationsLayer,
                                                   "\" keeps the explorations themselves"));
  }
  // Written so that NaN fails.
  if (!(order.robot_radius_m >= 0.0 && order.robot_radius_m <= kMaxRobotRadius_m)) {
    return absl::InvalidArgumentError(
        absl::StrCat("robot_radius_m must lie in [0, ", kMaxRobotRadius_m, "]"));
  }
  if (!(order.range_m > 0.0 && order.range_m <= kMaxRange_m)) {
    return absl::InvalidArgumentError(absl::StrCat("range_m must lie in (0, ", kMaxRange_m, "]"));
  }
  if (order.min_gain_cells < 1) {
    return absl::InvalidArgumentError("min_gain_cells must be positive");
  }
  return absl::OkStatus();
}

// Adds an edit that creates the layer if there is none of its name. FAILED_PRECONDITION if there is
// one of another kind.
absl::Status EnsureLayer(const Snapshot& snapshot, const LayerSpec& spec,
                         std::vector<Edit>* edits) {
  const Layer* layer = snapshot.FindLayer(spec.name);
  if (layer != nullptr) return CheckKind(layer->spec(), spec.kind);
  edits->push_back(CreateLayer{spec});
  return absl::OkStatus();
}

LayerSpec ExplorationLayerOf(const StartOrder& order, const LayerSpec& occupancy) {
  LayerSpec spec;
  spec.name = order.exploration_layer;
  spec.kind = LayerKind::kExploration;
  spec.frame_id = occupancy.frame_id;
  spec.grid = occupancy.grid;
  spec.explored_rule = order.explored_rule;
  return spec;
}

LayerSpec LayerOfExplorations(const Snapshot& snapshot) {
  LayerSpec spec;
  spec.name = kExplorationsLayer;
  spec.kind = LayerKind::kSemantic;
  spec.frame_id = snapshot.frame_id;
  return spec;
}

Exploration ExplorationOf(const StartOrder& order, absl::Time now) {
  Exploration exploration;
  exploration.area = order.area;
  exploration.occupancy_layer = order.occupancy_layer;
  exploration.exploration_layer = order.exploration_layer;
  exploration.robot_radius_m = order.robot_radius_m;
  exploration.range_m = order.range_m;
  exploration.min_gain_cells = order.min_gain_cells;
  exploration.started = now;
  return exploration;
}

}  // namespace

absl::StatusOr<EditBatch> StartBatch(const Snapshot& snapshot, const StartOrder& order,
                                     absl::Time now) {
  if (auto status = CheckOrder(order); !status.ok()) return status;
  const absl::StatusOr<LayerPtr> occupancy = snapshot.GetLayer(order.occupancy_layer);
  if (!occupancy.ok()) return occupancy.status();
  const LayerSpec& occupancy_spec = (*occupancy)->spec();
  if (auto status = CheckKind(occupancy_spec, LayerKind::kOccupancy); !status.ok()) return status;
  EditBatch batch;
  batch.time = now;
  absl::Status status =
      EnsureLayer(snapshot, ExplorationLayerOf(order, occupancy_spec), &batch.edits);
  if (status.ok()) status = EnsureLayer(snapshot, LayerOfExplorations(snapshot), &batch.edits);
  if (!status.ok()) return status;
  absl::StatusOr<std::string> frame = snapshot.ResolveFrame(order.frame_id);
  if (!frame.ok()) return frame.status();
  batch.edits.push_back(
      PutObject{kExplorationsLayer, ToObject(ExplorationOf(order, now)), *std::move(frame)});
  return batch;
}

}  // namespace hypermap::server
