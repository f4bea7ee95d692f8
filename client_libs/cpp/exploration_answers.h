// Answers of a server about explorations, as plain values. Positions are in the requested frame.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/geometry/point.h"
#include "map/grid/cell_rule.h"
#include "map/snapshot.h"

namespace hypermap::client {

struct StartOptions {
  std::string frame_id;  // of the area; empty: the map's own
  double robot_radius_m = 0.25;
  double range_m = 4.0;
  int64_t min_gain_cells = 4;
  // For an exploration layer that the call creates.
  CellRule explored_rule = CellRule::kCentre;
};

// A viewpoint that is leased to a robot.
struct Goal {
  ObjectId id = 0;
  std::string robot;
  Point position;
  int64_t gain_cells = 0;
  double path_length_m = 0.0;
  absl::Time expires_at;
};

// A viewpoint that a robot could not reach.
struct GivenUpPlace {
  ObjectId id = 0;
  std::string robot;
  Point position;
};

struct ExplorationEntry {
  // The area is in the requested frame.
  Exploration exploration;
  std::vector<Goal> goals;
  std::vector<GivenUpPlace> unreachable_places;
};

// Numbers of floor cells, in cells of the occupancy layer.
struct ExplorationProgress {
  int64_t explored_cells = 0;
  int64_t reachable_cells = 0;    // unexplored, in sight of places that robots can reach
  int64_t unreachable_cells = 0;  // unexplored, not in sight of such places
  double fraction = 1.0;          // explored / (explored + reachable)
  double rate_m2_per_s = 0.0;     // mean over the last minute
  double cell_area_m2 = 0.0;
};

struct StartAnswer {
  Revision revision = 0;
  ExplorationEntry entry;
};

struct ExplorationAnswer {
  Revision revision = 0;
  std::string frame_id;
  ExplorationEntry entry;
  ExplorationProgress progress;
};

struct ExplorationList {
  Revision revision = 0;
  std::string frame_id;
  std::vector<ExplorationEntry> explorations;  // newest first
};

struct FrontierEntry {
  int64_t num_cells = 0;
  Point centroid;
  std::optional<Point> viewpoint;  // nullopt: no viewpoint was found
  int64_t gain_cells = 0;
  std::vector<Point> cells;  // only if requested
};

struct FrontierList {
  Revision revision = 0;
  std::string frame_id;
  ObjectId exploration_id = 0;
  std::vector<FrontierEntry> frontiers;  // largest first
};

struct ClaimOptions {
  ObjectId exploration_id = 0;  // 0: the newest
  std::string frame_id;         // of the position and the goal; empty: the map's own
  absl::Duration lease = absl::Minutes(1);
};

struct ClaimAnswer {
  Revision revision = 0;
  ObjectId exploration_id = 0;
  ExplorationState state = ExplorationState::kActive;
  EndReason end_reason = EndReason::kNone;
  // nullopt: there is no goal now; ask again later unless the exploration has ended.
  std::optional<Goal> goal;
};

using hypermap::GoalOutcome;

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_
