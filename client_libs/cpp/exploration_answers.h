// What a server answers about explorations. Plain values; positions in the frame asked for.
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
  // Of an exploration layer that is created.
  CellRule explored_rule = CellRule::kCentre;
};

// A place that a robot is on the way to.
struct Goal {
  ObjectId id = 0;
  std::string robot;
  Point position;
  int64_t gain_cells = 0;
  double path_length_m = 0.0;
  absl::Time expires_at;
};

// A place that a robot could not get to.
struct GivenUpPlace {
  ObjectId id = 0;
  std::string robot;
  Point position;
};

struct ExplorationEntry {
  // The area is in the frame asked for.
  Exploration exploration;
  std::vector<Goal> goals;
  std::vector<GivenUpPlace> unreachable_places;
};

// Cells of floor, of the occupancy layer.
struct ExplorationProgress {
  int64_t explored_cells = 0;
  int64_t reachable_cells = 0;    // not seen yet, and in sight of where robots can go
  int64_t unreachable_cells = 0;  // not seen, and not so
  double fraction = 1.0;          // explored / (explored + reachable)
  double rate_m2_per_s = 0.0;     // in the last minute
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
  std::vector<ExplorationEntry> explorations;  // the newest first
};

struct FrontierEntry {
  int64_t num_cells = 0;
  Point centroid;
  std::optional<Point> viewpoint;  // nullopt: seen from nowhere
  int64_t gain_cells = 0;
  std::vector<Point> cells;  // if asked for
};

struct FrontierList {
  Revision revision = 0;
  std::string frame_id;
  ObjectId exploration_id = 0;
  std::vector<FrontierEntry> frontiers;  // the largest first
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
  // nullopt: nothing to do now; ask again later unless it has ended.
  std::optional<Goal> goal;
};

using hypermap::GoalOutcome;

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_
