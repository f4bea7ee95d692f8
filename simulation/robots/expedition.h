// Runs an exploration of an area by simulated robots, from start to end.
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
  // Semantic layer for the robots' observations; created if there is none.
  std::string semantic_layer = "semantic_explored";
  // Layers with the objects of the world, which the robots do not know. Empty: all semantic layers
  // except `semantic_layer`, fused layers and explorations.
  std::vector<std::string> object_layers;
  // Area to explore, in the map's own frame.
  Polygon area;
  int robots = 1;
  // Robots are NAME-1, NAME-2, ...
  std::string name = "robot";
  // Start positions in the map's frame, one for each robot. Empty: random places in the largest
  // region of the area; a robot's place does not depend on the number of robots.
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
  // The exploration fails with DEADLINE_EXCEEDED after this many steps. 0: no limit.
  int64_t max_steps = 0;
  // Longest time to retry while the server is unavailable.
  absl::Duration patience = absl::Seconds(30);
};

struct ExpeditionReport {
  ObjectId exploration_id = 0;
  Revision revision = 0;
  // Steps of simulated time, 0.2 s each, until the last robot knew that the exploration had ended.
  int64_t steps = 0;
  EndReason end_reason = EndReason::kNone;
  VisibleFloor floor;
  client::ExplorationProgress server_progress;
  // Number of goals that were nearer than a robot's radius to another robot's current goal.
  int64_t conflicts = 0;
  std::vector<RobotLog> robots;
  std::vector<std::string> robot_names;
  // GeoJSON of the world's objects and how often each was seen, for `hypermap eval --truth`.
  std::string truth;
  int64_t num_objects = 0;
  int64_t num_objects_seen = 0;  // Objects that were seen in at least five frames.
  absl::Duration time;
};

struct ExpeditionProgress {
  int64_t steps = 0;
  int64_t goals = 0;      // Goals that robots reached.
  double fraction = 0.0;  // Explored share of the floor, by the server.
};
// Called every 25 steps, on the thread that called Explore().
using TellProgress = std::function<void(const ExpeditionProgress&)>;

// Explores the area, using only the client. All robots step in turn on the caller's thread, so that
// the same seed on the same map gives the same steps. Errors: INVALID_ARGUMENT if no robot can
// stand in the area or at a start, CANCELLED if `is_interrupted` returned true. The robots' goals
// are released on an error.
absl::StatusOr<ExpeditionReport> Explore(client::Client& client, const ExpeditionOptions& options,
                                         const std::function<bool()>& is_interrupted,
                                         const TellProgress& tell_progress);

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_EXPEDITION_H_
