// Explorations as objects of a semantic layer.
//
// The area, the goals and the unreachable places of an exploration are ordinary objects: they are
// stored, watched, queried and kept in the history like all others. A goal's lease is the expiry
// time of its object.
#ifndef HYPERMAP_MAP_EXPLORATION_EXPLORATION_OBJECTS_H_
#define HYPERMAP_MAP_EXPLORATION_EXPLORATION_OBJECTS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/geometry/polygon.h"
#include "map/layers/semantic_layer.h"
#include "map/objects/semantic_object.h"

namespace hypermap {

inline constexpr char kExplorationsLayer[] = "explorations";

// Labels of the three kinds of objects.
inline constexpr char kExplorationLabel[] = "exploration";
inline constexpr char kGoalLabel[] = "exploration goal";
inline constexpr char kUnreachableLabel[] = "unreachable place";

inline constexpr double kMaxRobotRadius_m = 5.0;
inline constexpr double kMaxRange_m = 50.0;

// The newest goals and unreachable places of an exploration count, up to these numbers. Robots make
// fewer, but clients may put any number of such objects on the map.
inline constexpr size_t kMaxGoals = 1'000;
inline constexpr size_t kMaxUnreachablePlaces = 10'000;

enum class ExplorationState { kActive, kEnded };
enum class EndReason { kNone, kDone, kOnlyUnreachableLeft, kStopped };
// The ways in which a robot's trip to its goal ends.
enum class GoalOutcome { kReached, kUnreachable, kAbandoned };

// Return "active" or "ended"; and "", "done", "only_unreachable_left" or "stopped".
absl::string_view ExplorationStateName(ExplorationState state);
absl::string_view EndReasonName(EndReason reason);

struct Exploration {
  ObjectId id = 0;
  // In the frame of the layer that contains the object.
  Polygon area;
  std::string occupancy_layer;
  std::string exploration_layer;
  double robot_radius_m = 0.25;
  double range_m = 4.0;
  int64_t min_gain_cells = 4;
  ExplorationState state = ExplorationState::kActive;
  EndReason end_reason = EndReason::kNone;
  absl::Time started;
  std::optional<absl::Time> ended;

  friend bool operator==(const Exploration&, const Exploration&) = default;
};

struct ExplorationGoal {
  ObjectId id = 0;
  ObjectId exploration_id = 0;
  std::string robot;
  // The cell to go to; the goal is its centre.
  Polygon cell;
  int64_t gain_cells = 0;
  double path_length_m = 0.0;
  // The end of the lease; nullopt before the object is on the map.
  std::optional<absl::Time> expires_at;

  friend bool operator==(const ExplorationGoal&, const ExplorationGoal&) = default;
};

struct UnreachablePlace {
  ObjectId id = 0;
  ObjectId exploration_id = 0;
  std::string robot;
  Polygon cell;
  // The version of the occupancy layer when the place was given up. Newer versions may have made it
  // reachable.
  int64_t occupancy_version = 0;

  friend bool operator==(const UnreachablePlace&, const UnreachablePlace&) = default;
};

SemanticObject ToObject(const Exploration& exploration);
SemanticObject ToObject(const ExplorationGoal& goal);
SemanticObject ToObject(const UnreachablePlace& place);

// Convert objects back. DATA_LOSS names the object and the attribute that is missing or invalid:
// people may edit these objects.
absl::StatusOr<Exploration> ToExploration(const SemanticObject& object);
absl::StatusOr<ExplorationGoal> ToGoal(const SemanticObject& object);
absl::StatusOr<UnreachablePlace> ToUnreachablePlace(const SemanticObject& object);

struct ExplorationObjects {
  Exploration exploration;
  // Sorted by id. At most kMaxGoals and kMaxUnreachablePlaces.
  std::vector<ExplorationGoal> goals;
  std::vector<UnreachablePlace> unreachable_places;
};

// Returns all explorations of a layer, the newest first. Leaves out goals and places whose
// exploration was deleted, and objects with other labels. DATA_LOSS as above; errors of
// CheckCancelled.
absl::StatusOr<std::vector<ExplorationObjects>> ReadExplorations(const SemanticLayer& layer);
// Returns an exploration; the newest if `id` is 0. NOT_FOUND naming the id; errors as
// ReadExplorations, also those of other explorations.
absl::StatusOr<ExplorationObjects> FindExploration(const SemanticLayer& layer, ObjectId id);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_EXPLORATION_OBJECTS_H_
