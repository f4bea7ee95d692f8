// The requests to MapExplorations and its answers.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_CALLS_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_CALLS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/explorer.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "map/grid/cell_rule.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer_spec.h"
#include "map/snapshot.h"

namespace hypermap::server {

inline constexpr double kDefaultRange_m = 4.0;
inline constexpr int64_t kDefaultMinGainCells = 4;
inline constexpr absl::Duration kDefaultLease = absl::Minutes(1);
inline constexpr absl::Duration kMaxLease = absl::Minutes(10);

// In all requests, an empty frame_id is the map's own frame, and exploration 0 is the newest one.

struct ExplorationStart {
  Polygon area;
  std::string frame_id;
  std::string occupancy_layer;
  std::string exploration_layer;
  CellRule explored_rule = CellRule::kCentre;
  double robot_radius_m = 0.25;
  double range_m = kDefaultRange_m;
  int64_t min_gain_cells = kDefaultMinGainCells;
  std::string author;
  // Recognises a retry. Empty: a retry starts another exploration.
  std::string request_id;
};

struct GoalClaim {
  ObjectId exploration_id = 0;
  std::string robot;
  Point place;
  std::string frame_id;
  absl::Duration lease = kDefaultLease;
  std::string author;
};

struct GoalRenewal {
  std::string robot;
  ObjectId goal_id = 0;
  absl::Duration lease = kDefaultLease;
  std::string author;
};

struct GoalRelease {
  std::string robot;
  ObjectId goal_id = 0;
  GoalOutcome outcome = GoalOutcome::kReached;
  std::string author;
};

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

struct ExplorationProgress {
  Explorer::Progress cells;
  double cell_area_m2 = 0.0;
  double rate_m2_per_s = 0.0;
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
