// What is asked of a map's explorations, and answered.
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

// An empty frame is the map's own; exploration 0 is the newest.

struct StartOrder {
  Polygon area;
  std::string frame_id;
  std::string occupancy_layer;
  std::string exploration_layer;
  CellRule explored_rule = CellRule::kCentre;
  double robot_radius_m = 0.25;
  double range_m = kDefaultRange_m;
  int64_t min_gain_cells = kDefaultMinGainCells;
  std::string author;
  // Empty: not guarded against repetition.
  std::string request_id;
};

struct ClaimOrder {
  ObjectId exploration_id = 0;
  std::string robot;
  Point place;
  std::string frame_id;
  absl::Duration lease = kDefaultLease;
  std::string author;
};

struct RenewOrder {
  std::string robot;
  ObjectId goal_id = 0;
  absl::Duration lease = kDefaultLease;
  std::string author;
};

struct ReleaseOrder {
  std::string robot;
  ObjectId goal_id = 0;
  GoalOutcome outcome = GoalOutcome::kReached;
  std::string author;
};

// Of the revision at which it was read, or made.
struct ExplorationAnswer {
  Revision revision = 0;
  // That the answer is told in, and how it comes from the frame of the objects.
  std::string frame_id;
  PlanarTransform frame_from_layer;
  // What was committed for it.
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
  // Cells of the occupancy layer; the largest first.
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

// FAILED_PRECONDITION naming the layer unless it is of the kind.
absl::Status CheckKind(const LayerSpec& spec, LayerKind kind);

// Makes `answer` one of `snapshot`, in the frame asked for; the objects lie in `layer_frame`.
// NOT_FOUND when the frame is not known or not connected.
absl::Status SetFrame(const Snapshot& snapshot, const std::string& layer_frame,
                      const std::string& frame_id, ExplorationAnswer* answer);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_CALLS_H_
