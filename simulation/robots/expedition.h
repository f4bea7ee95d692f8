// Robots that explore an area together, from the start to the end.
#ifndef HYPERMAP_SIMULATION_ROBOTS_EXPEDITION_H_
#define HYPERMAP_SIMULATION_ROBOTS_EXPEDITION_H_

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"
#include "map/geometry/polygon.h"
#include "simulation/robots/robot.h"
#include "simulation/robots/visible_floor.h"

namespace hypermap::robots {

struct ExpeditionOptions {
  std::string map;
  std::string occupancy_layer = "occupancy";
  std::string explored_layer = "explored";
  // Where what robots detect goes; made where there is none.
  std::string semantic_layer = "semantic_explored";
  // The objects of the world, which the robots do not know. Empty: all semantic layers but
  // `semantic_layer`, those that robots wrote, and explorations.
  std::vector<std::string> object_layers;
  // In the map's own frame.
  Polygon area;
  int robots = 1;
  // Robots are NAME-1, NAME-2, ...
  std::string name = "robot";
  // Where they set out, in the map's frame: none, or one for each. Without, places in the largest
  // region of the area by chance; the first is the same for any number of robots.
  std::vector<Point> starts;
  double robot_radius_m = 0.25;
  double range_m = 4.0;
  int64_t min_gain_cells = 4;
  CellRule explored_rule = CellRule::kTouched;
  absl::Duration lease = absl::Minutes(1);
  int frame_every = 3;
  bool noisy_detector = false;
  bool pose_error = false;
  uint64_t seed = 1;
  // An error when it is not at its end by then. 0: for as long as it takes.
  int64_t max_steps = 0;
  // For how long a server that went away is waited for.
  absl::Duration patience = absl::Seconds(30);
};

struct ExpeditionReport {
  ObjectId exploration_id = 0;
  Revision revision = 0;
  // Of simulated time, 0.2 s each, until the last robot knew that it has ended.
  int64_t steps = 0;
  EndReason end_reason = EndReason::kNone;
  VisibleFloor floor;
  client::ExplorationProgress server_progress;
  // Times that a robot was given a goal where another one was on the way to.
  int64_t conflicts = 0;
  std::vector<RobotLog> robots;
  std::vector<std::string> robot_names;
  // GeoJSON of the objects of the world, with how often each was seen: for `hypermap eval --truth`.
  std::string truth;
  int64_t num_objects = 0;
  int64_t num_objects_seen = 0;  // in five frames or more
  absl::Duration time;
};

struct ExpeditionProgress {
  int64_t steps = 0;
  int64_t goals = 0;      // reached
  double fraction = 0.0;  // explored, as the server says
};
// Called now and then.
using TellProgress = std::function<void(const ExpeditionProgress&)>;

// Explores by way of the client alone, robots in turn, one thread: the same seed against the same
// map makes the same steps. INVALID_ARGUMENT for an area without a place to stand in, CANCELLED
// when `is_interrupted` said so; goals are given back then.
absl::StatusOr<ExpeditionReport> Explore(client::Client& client, const ExpeditionOptions& options,
                                         const std::function<bool()>& is_interrupted,
                                         const TellProgress& tell_progress);

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_EXPEDITION_H_
