// The answers of MapExplorations to the requests of map/exploration/exploration_requests.h.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_CALLS_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_CALLS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/exploration_requests.h"
#include "map/exploration/exploration_view.h"
#include "map/exploration/explorer.h"
#include "map/frames/planar_transform.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer_spec.h"
#include "map/snapshot.h"

namespace hypermap::server {

struct ExplorationAnswer {
  // The revision that was read or, if the call changed the map, that it made.
  Revision revision = 0;
  // The requested frame, and the transform to it from the frame of the objects.
  std::string frame_id;
  PlanarTransform frame_from_layer;
  // Number of edits that the call committed.
  int64_t num_edits = 0;
};

struct ExplorationView : ExplorationAnswer {
  ExplorationObjects objects;
};

struct ExplorationReport : ExplorationView {
  ExplorationProgress progress;
};

struct ExplorationList : ExplorationAnswer {
  std::vector<ExplorationObjects> explorations;  // the newest first
};

struct FrontierList : ExplorationAnswer {
  ObjectId exploration_id = 0;
  // Cells of the occupancy layer; the largest frontier first.
  std::vector<Explorer::FrontierView> frontiers;
  GridGeometry geometry;
  PlanarTransform frame_from_floor;
};

struct ClaimAnswer : ExplorationAnswer {
  ObjectId exploration_id = 0;
  ExplorationState state = ExplorationState::kActive;
  EndReason end_reason = EndReason::kNone;
  std::optional<ExplorationGoal> goal;
};

struct GoalAnswer : ExplorationAnswer {
  ExplorationGoal goal;
};

inline bool IsActive(const Exploration& exploration) {
  return exploration.state == ExplorationState::kActive;
}

// FAILED_PRECONDITION naming the layer if it is of another kind.
absl::Status CheckKind(const LayerSpec& spec, LayerKind kind);

// Fills in the revision of `snapshot`, the frame `frame_id` and its transform from `layer_frame`,
// which the objects are in. NOT_FOUND if the frame is unknown or not connected.
absl::Status SetFrame(const Snapshot& snapshot, const std::string& layer_frame,
                      const std::string& frame_id, ExplorationAnswer* answer);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_CALLS_H_
