// The requests of robots and operators about explorations.
//
// In all requests, an empty frame_id is the map's own frame, and exploration 0 is the newest one.
// `author` is not part of a message: the server takes it from the call.
#ifndef HYPERMAP_MAP_EXPLORATION_EXPLORATION_REQUESTS_H_
#define HYPERMAP_MAP_EXPLORATION_EXPLORATION_REQUESTS_H_

#include <cstdint>
#include <string>

#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"
#include "map/grid/cell_rule.h"
#include "map/objects/semantic_object.h"

namespace hypermap {

inline constexpr double kDefaultRange_m = 4.0;
inline constexpr int64_t kDefaultMinGainCells = 4;
inline constexpr absl::Duration kDefaultLease = absl::Minutes(1);

struct ExplorationStart {
  Polygon area;
  std::string frame_id;
  std::string occupancy_layer;
  std::string exploration_layer;
  // For an exploration layer that the call creates.
  CellRule explored_rule = CellRule::kCentre;
  double robot_radius_m = 0.25;
  double range_m = kDefaultRange_m;
  int64_t min_gain_cells = kDefaultMinGainCells;
  std::string author;
  // Recognises a retry. Empty: a retry starts another exploration.
  std::string request_id;
  // Digest of everything that the request asks: a request with the same id and another digest is
  // not a retry.
  std::string request_digest;
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

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_EXPLORATION_REQUESTS_H_
