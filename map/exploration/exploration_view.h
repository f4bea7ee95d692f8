// Explorations as callers see them: plain values with positions in the caller's frame.
#ifndef HYPERMAP_MAP_EXPLORATION_EXPLORATION_VIEW_H_
#define HYPERMAP_MAP_EXPLORATION_EXPLORATION_VIEW_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/explorer.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/grid/grid_geometry.h"

namespace hypermap {

// A viewpoint that is leased to a robot.
struct LeasedGoal {
  ObjectId id = 0;
  std::string robot;
  Point position;
  int64_t gain_cells = 0;
  double path_length_m = 0.0;
  absl::Time expires_at;  // the Unix epoch if the goal has no end

  friend bool operator==(const LeasedGoal&, const LeasedGoal&) = default;
};

// A viewpoint that a robot could not reach.
struct GivenUpPlace {
  ObjectId id = 0;
  std::string robot;
  Point position;

  friend bool operator==(const GivenUpPlace&, const GivenUpPlace&) = default;
};

struct ExplorationEntry {
  Exploration exploration;  // its area is in the caller's frame
  std::vector<LeasedGoal> goals;
  std::vector<GivenUpPlace> unreachable_places;

  friend bool operator==(const ExplorationEntry&, const ExplorationEntry&) = default;
};

struct ExplorationProgress {
  Explorer::Progress cells;  // numbers of cells of the occupancy layer
  double cell_area_m2 = 0.0;
  double rate_m2_per_s = 0.0;  // mean over the last minute

  // explored / (explored + reachable); 1 if both are 0.
  double fraction() const;
};

struct FrontierEntry {
  int64_t num_cells = 0;
  Point centroid;
  std::optional<Point> viewpoint;  // nullopt: no viewpoint was found
  int64_t gain_cells = 0;
  std::vector<Point> cells;  // their centres; only if requested

  friend bool operator==(const FrontierEntry&, const FrontierEntry&) = default;
};

// The answer to a GoalClaim.
struct ClaimResult {
  ObjectId exploration_id = 0;
  ExplorationState state = ExplorationState::kActive;
  EndReason end_reason = EndReason::kNone;
  // nullopt: there is no goal now; ask again later unless the exploration has ended.
  std::optional<LeasedGoal> goal;

  friend bool operator==(const ClaimResult&, const ClaimResult&) = default;
};

// A goal and a place are at the centroids of their cells.
LeasedGoal ViewOf(const ExplorationGoal& goal, const PlanarTransform& frame_from_layer);
GivenUpPlace ViewOf(const UnreachablePlace& place, const PlanarTransform& frame_from_layer);
ExplorationEntry ViewOf(const ExplorationObjects& objects, const PlanarTransform& frame_from_layer);

// `geometry` is that of the occupancy layer, and `frame_from_floor` starts from that layer's frame.
FrontierEntry ViewOf(const Explorer::FrontierView& frontier, const GridGeometry& geometry,
                     const PlanarTransform& frame_from_floor, bool with_cells);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_EXPLORATION_VIEW_H_
