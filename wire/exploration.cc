#include "wire/exploration.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/enum_names.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

constexpr EnumNames<ExplorationState, v1::ExplorationState, 2> kStates{{
    {ExplorationState::kActive, v1::EXPLORATION_STATE_ACTIVE},
    {ExplorationState::kEnded, v1::EXPLORATION_STATE_ENDED},
}};

constexpr EnumNames<EndReason, v1::EndReason, 4> kReasons{{
    {EndReason::kNone, v1::END_REASON_UNSPECIFIED},
    {EndReason::kDone, v1::END_REASON_DONE},
    {EndReason::kOnlyUnreachableLeft, v1::END_REASON_ONLY_UNREACHABLE_LEFT},
    {EndReason::kStopped, v1::END_REASON_STOPPED},
}};

constexpr EnumNames<GoalOutcome, v1::GoalOutcome, 3> kGoalOutcomes{{
    {GoalOutcome::kReached, v1::GOAL_OUTCOME_REACHED},
    {GoalOutcome::kUnreachable, v1::GOAL_OUTCOME_UNREACHABLE},
    {GoalOutcome::kAbandoned, v1::GOAL_OUTCOME_ABANDONED},
}};

absl::StatusOr<GivenUpPlace> DecodePlace(absl::string_view field,
                                         const v1::UnreachablePlace& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point position,
                            DecodePoint(absl::StrCat(field, ".position"), message.position()));
  return GivenUpPlace{message.id(), message.robot(), position};
}

// Decodes the exploration itself, without its goals and places.
absl::StatusOr<Exploration> DecodeSettings(absl::string_view field,
                                           const v1::Exploration& message) {
  Exploration exploration;
  HYPERMAP_ASSIGN_OR_RETURN(const ExplorationState state,
                            DecodeExplorationState(absl::StrCat(field, ".state"), message.state()));
  HYPERMAP_ASSIGN_OR_RETURN(
      const EndReason reason,
      DecodeEndReason(absl::StrCat(field, ".end_reason"), message.end_reason()));
  HYPERMAP_ASSIGN_OR_RETURN(Polygon area,
                            DecodePolygon(absl::StrCat(field, ".area"), message.area()));
  exploration.id = message.id();
  exploration.area = std::move(area);
  exploration.occupancy_layer = message.occupancy_layer();
  exploration.exploration_layer = message.exploration_layer();
  exploration.robot_radius_m = message.robot_radius_m();
  exploration.range_m = message.range_m();
  exploration.min_gain_cells = message.min_gain_cells();
  exploration.state = state;
  exploration.end_reason = reason;
  exploration.started = DecodeTime(message.start_time());
  if (message.has_end_time()) exploration.ended = DecodeTime(message.end_time());
  return exploration;
}

}  // namespace

v1::ExplorationState EncodeExplorationState(ExplorationState state) {
  return EncodeEnum(kStates, state);
}

absl::StatusOr<ExplorationState> DecodeExplorationState(absl::string_view field,
                                                        v1::ExplorationState state) {
  return DecodeEnum(kStates, field, state);
}

v1::EndReason EncodeEndReason(EndReason reason) { return EncodeEnum(kReasons, reason); }

absl::StatusOr<EndReason> DecodeEndReason(absl::string_view field, v1::EndReason reason) {
  return DecodeEnum(kReasons, field, reason);
}

v1::GoalOutcome EncodeGoalOutcome(GoalOutcome outcome) {
  return EncodeEnum(kGoalOutcomes, outcome);
}

absl::StatusOr<GoalOutcome> DecodeGoalOutcome(absl::string_view field, v1::GoalOutcome outcome) {
  return DecodeEnum(kGoalOutcomes, field, outcome);
}

void EncodeGoal(const LeasedGoal& goal, v1::Goal* message) {
  message->set_id(goal.id);
  message->set_robot(goal.robot);
  EncodePoint(goal.position, message->mutable_position());
  message->set_gain_cells(goal.gain_cells);
  message->set_path_length_m(goal.path_length_m);
  if (goal.expires_at != absl::UnixEpoch()) {
    EncodeTime(goal.expires_at, message->mutable_expire_time());
  }
}

absl::StatusOr<LeasedGoal> DecodeGoal(absl::string_view field, const v1::Goal& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point position,
                            DecodePoint(absl::StrCat(field, ".position"), message.position()));
  return LeasedGoal{
      message.id(),         message.robot(),         position,
      message.gain_cells(), message.path_length_m(), DecodeTime(message.expire_time())};
}

void EncodeExploration(const ExplorationEntry& entry, v1::Exploration* message) {
  const Exploration& exploration = entry.exploration;
  message->set_id(exploration.id);
  message->set_state(EncodeExplorationState(exploration.state));
  message->set_end_reason(EncodeEndReason(exploration.end_reason));
  EncodePolygon(exploration.area, message->mutable_area());
  message->set_occupancy_layer(exploration.occupancy_layer);
  message->set_exploration_layer(exploration.exploration_layer);
  message->set_robot_radius_m(exploration.robot_radius_m);
  message->set_range_m(exploration.range_m);
  message->set_min_gain_cells(exploration.min_gain_cells);
  EncodeTime(exploration.started, message->mutable_start_time());
  if (exploration.ended) EncodeTime(*exploration.ended, message->mutable_end_time());
  for (const LeasedGoal& goal : entry.goals) EncodeGoal(goal, message->add_goals());
  for (const GivenUpPlace& place : entry.unreachable_places) {
    v1::UnreachablePlace* const encoded = message->add_unreachable_places();
    encoded->set_id(place.id);
    encoded->set_robot(place.robot);
    EncodePoint(place.position, encoded->mutable_position());
  }
}

absl::StatusOr<ExplorationEntry> DecodeExploration(absl::string_view field,
                                                   const v1::Exploration& message) {
  HYPERMAP_ASSIGN_OR_RETURN(Exploration exploration, DecodeSettings(field, message));
  ExplorationEntry entry{std::move(exploration), {}, {}};
  for (const v1::Goal& encoded : message.goals()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        LeasedGoal goal,
        DecodeGoal(absl::StrCat(field, ".goals[", entry.goals.size(), "]"), encoded));
    entry.goals.push_back(std::move(goal));
  }
  for (const v1::UnreachablePlace& encoded : message.unreachable_places()) {
    HYPERMAP_ASSIGN_OR_RETURN(GivenUpPlace place,
                              DecodePlace(absl::StrCat(field, ".unreachable_places[",
                                                       entry.unreachable_places.size(), "]"),
                                          encoded));
    entry.unreachable_places.push_back(std::move(place));
  }
  return entry;
}

void EncodeProgress(const ExplorationProgress& progress, v1::ExplorationProgress* message) {
  message->set_explored_cells(progress.cells.explored);
  message->set_reachable_cells(progress.cells.reachable);
  message->set_unreachable_cells(progress.cells.unreachable);
  message->set_fraction(progress.fraction());
  message->set_rate_m2_per_s(progress.rate_m2_per_s);
  message->set_cell_area_m2(progress.cell_area_m2);
}

ExplorationProgress DecodeProgress(const v1::ExplorationProgress& message) {
  return {{message.explored_cells(), message.reachable_cells(), message.unreachable_cells()},
          message.cell_area_m2(),
          message.rate_m2_per_s()};
}

void EncodeFrontier(const FrontierEntry& frontier, v1::Frontier* message) {
  message->set_num_cells(frontier.num_cells);
  EncodePoint(frontier.centroid, message->mutable_centroid());
  if (frontier.viewpoint) EncodePoint(*frontier.viewpoint, message->mutable_viewpoint());
  message->set_gain_cells(frontier.gain_cells);
  for (const Point& cell : frontier.cells) EncodePoint(cell, message->add_cells());
}

absl::StatusOr<FrontierEntry> DecodeFrontier(absl::string_view field, const v1::Frontier& message) {
  FrontierEntry entry;
  entry.num_cells = message.num_cells();
  entry.gain_cells = message.gain_cells();
  HYPERMAP_ASSIGN_OR_RETURN(entry.centroid,
                            DecodePoint(absl::StrCat(field, ".centroid"), message.centroid()));
  if (message.has_viewpoint()) {
    HYPERMAP_ASSIGN_OR_RETURN(entry.viewpoint,
                              DecodePoint(absl::StrCat(field, ".viewpoint"), message.viewpoint()));
  }
  entry.cells.reserve(message.cells_size());
  for (const v1::Point& cell : message.cells()) {
    HYPERMAP_ASSIGN_OR_RETURN(const Point centre, DecodePoint(absl::StrCat(field, ".cells"), cell));
    entry.cells.push_back(centre);
  }
  return entry;
}

void EncodeClaimResult(const ClaimResult& result, v1::ClaimGoalResponse* message) {
  message->set_exploration_id(result.exploration_id);
  message->set_state(EncodeExplorationState(result.state));
  message->set_end_reason(EncodeEndReason(result.end_reason));
  if (result.goal) EncodeGoal(*result.goal, message->mutable_goal());
}

absl::StatusOr<ClaimResult> DecodeClaimResult(const v1::ClaimGoalResponse& message) {
  ClaimResult result{.exploration_id = message.exploration_id()};
  HYPERMAP_ASSIGN_OR_RETURN(result.state, DecodeExplorationState("state", message.state()));
  HYPERMAP_ASSIGN_OR_RETURN(result.end_reason, DecodeEndReason("end_reason", message.end_reason()));
  if (message.has_goal()) {
    HYPERMAP_ASSIGN_OR_RETURN(result.goal, DecodeGoal("goal", message.goal()));
  }
  return result;
}

}  // namespace hypermap::wire
