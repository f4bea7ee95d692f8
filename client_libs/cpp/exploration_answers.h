// Answers of a server about explorations, as plain values. Positions are in the requested frame.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/exploration_requests.h"
#include "map/exploration/exploration_view.h"
#include "map/grid/cell_rule.h"
#include "map/snapshot.h"

namespace hypermap::client {

struct StartOptions {
  std::string frame_id;  // of the area; empty: the map's own
  double robot_radius_m = 0.25;
  double range_m = kDefaultRange_m;
  int64_t min_gain_cells = kDefaultMinGainCells;
  // For an exploration layer that the call creates.
  CellRule explored_rule = CellRule::kCentre;
};

using hypermap::ExplorationEntry;
using hypermap::ExplorationProgress;
using hypermap::FrontierEntry;
using hypermap::GivenUpPlace;
using hypermap::GoalOutcome;
using hypermap::LeasedGoal;

// In each answer, `incarnation` is that of the map to which the revision belongs.
struct StartAnswer {
  Revision revision = 0;
  ExplorationEntry entry;
  uint64_t incarnation = 0;
};

struct ExplorationAnswer {
  Revision revision = 0;
  std::string frame_id;
  ExplorationEntry entry;
  ExplorationProgress progress;
  uint64_t incarnation = 0;
};

struct ExplorationList {
  Revision revision = 0;
  std::string frame_id;
  std::vector<ExplorationEntry> explorations;  // newest first
  uint64_t incarnation = 0;
};

struct FrontierList {
  Revision revision = 0;
  std::string frame_id;
  ObjectId exploration_id = 0;
  std::vector<FrontierEntry> frontiers;  // largest first
  uint64_t incarnation = 0;
};

struct ClaimOptions {
  ObjectId exploration_id = 0;  // 0: the newest
  std::string frame_id;         // of the position and the goal; empty: the map's own
  absl::Duration lease = kDefaultLease;
};

struct ClaimAnswer : ClaimResult {
  Revision revision = 0;
  uint64_t incarnation = 0;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_EXPLORATION_ANSWERS_H_
