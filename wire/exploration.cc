#include "wire/exploration.h"

#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

template <typename Domain, typename Message, size_t kSize>
using Names = std::array<std::pair<Domain, Message>, kSize>;

constexpr Names<ExplorationState, v1::ExplorationState, 2> kStates{{
    {ExplorationState::kActive, v1::EXPLORATION_STATE_ACTIVE},
    {ExplorationState::kEnded, v1::EXPLORATION_STATE_ENDED},
}};

constexpr Names<EndReason, v1::EndReason, 4> kReasons{{
    {EndReason::kNone, v1::END_REASON_UNSPECIFIED},
    {EndReason::kDone, v1::END_REASON_DONE},
    {EndReason::kOnlyUnreachableLeft, v1::END_REASON_ONLY_UNREACHABLE_LEFT},
    {EndReason::kStopped, v1::END_REASON_STOPPED},
}};

constexpr Names<GoalOutcome, v1::GoalOutcome, 3> kOutcomes{{
    {GoalOutcome::kReached, v1::GOAL_OUTCOME_REACHED},
    {GoalOutcome::kUnreachable, v1::GOAL_OUTCOME_UNREACHABLE},
    {GoalOutcome::kAbandoned, v1::GOAL_OUTCOME_ABANDONED},
}};

// Returns 0 for other values, which is "unspecified" in each of these enumerations.
template <typename Domain, typename Message, size_t kSize>
Message EncodeEnum(const Names<Domain, Message, kSize>& names, Domain value) {
  for (const auto& [domain, message] : names) {
    if (domain == value) return message;
  }
  return static_cast<Message>(0);
}

template <typename Domain, typename Message, size_t kSize>
absl::StatusOr<Domain> DecodeEnum(const Names<Domain, Message, kSize>& names,
                                  absl::string_view field, Message value) {
  for (const auto& [domain, message] : names) {
    if (message == value) return domain;
  }
  if (static_cast<int>(value) == 0) return InvalidField(field, "is missing");
  return InvalidField(field, absl::StrCat("is not known: ", static_cast<int>(value)));
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

v1::GoalOutcome EncodeGoalOutcome(GoalOutcome outcome) { return EncodeEnum(kOutcomes, outcome); }

absl::StatusOr<GoalOutcome> DecodeGoalOutcome(absl::string_view field, v1::GoalOutcome outcome) {
  return DecodeEnum(kOutcomes, field, outcome);
}

void EncodeGoal(const ExplorationGoal& goal, const PlanarTransform& frame_from_layer,
                v1::Goal* message) {
  message->set_id(goal.id);
  message->set_robot(goal.robot);
  EncodePoint(frame_from_layer * Centroid(goal.cell), message->mutable_position());
  message->set_gain_cells(goal.gain_cells);
  message->set_path_length_m(goal.path_length_m);
  if (goal.expires_at) EncodeTime(*goal.expires_at, message->mutable_expire_time());
}

void EncodeUnreachablePlace(const UnreachablePlace& place, const PlanarTransform& frame_from_layer,
                            v1::UnreachablePlace* message) {
  message->set_id(place.id);
  message->set_robot(place.robot);
  EncodePoint(frame_from_layer * Centroid(place.cell), message->mutable_position());
}

void EncodeExploration(const ExplorationObjects& objects, const PlanarTransform& frame_from_layer,
                       v1::Exploration* message) {
  const Exploration& exploration = objects.exploration;
  message->set_id(exploration.id);
  message->set_state(EncodeExplorationState(exploration.state));
  message->set_end_reason(EncodeEndReason(exploration.end_reason));
  EncodePolygon(frame_from_layer * exploration.area, message->mutable_area());
  message->set_occupancy_layer(exploration.occupancy_layer);
  message->set_exploration_layer(exploration.exploration_layer);
  message->set_robot_radius_m(exploration.robot_radius_m);
  message->set_range_m(exploration.range_m);
  message->set_min_gain_cells(exploration.min_gain_cells);
  EncodeTime(exploration.started, message->mutable_start_time());
  if (exploration.ended) EncodeTime(*exploration.ended, message->mutable_end_time());
  for (const ExplorationGoal& goal : objects.goals) {
    EncodeGoal(goal, frame_from_layer, message->add_goals());
  }
  for (const UnreachablePlace& place : objects.unreachable_places) {
    EncodeUnreachablePlace(place, frame_from_layer, message->add_unreachable_places());
  }
}

absl::StatusOr<Exploration> DecodeExploration(absl::string_view field,
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

void EncodeProgress(const Explorer::Progress& cells, double cell_area_m2, double rate_m2_per_s,
                    v1::ExplorationProgress* message) {
  message->set_explored_cells(cells.explored);
  message->set_reachable_cells(cells.reachable);
  message->set_unreachable_cells(cells.unreachable);
  const int64_t all = cells.explored + cells.reachable;
  message->set_fraction(all == 0 ? 1.0 : static_cast<double>(cells.explored) / all);
  message->set_rate_m2_per_s(rate_m2_per_s);
  message->set_cell_area_m2(cell_area_m2);
}

void EncodeFrontier(const Explorer::FrontierView& frontier, const GridGeometry& geometry,
                    const PlanarTransform& frame_from_layer, bool with_cells,
                    v1::Frontier* message) {
  message->set_num_cells(static_cast<int64_t>(frontier.cells.size()));
  Point sum;
  for (const CellIndex& cell : frontier.cells) {
    const Point centre = frame_from_layer * geometry.CentreOf(cell);
    sum = {sum.x + centre.x, sum.y + centre.y};
    if (with_cells) EncodePoint(centre, message->add_cells());
  }
  const auto count = static_cast<double>(frontier.cells.size());
  EncodePoint({sum.x / count, sum.y / count}, message->mutable_centroid());
  if (!frontier.viewpoint) return;
  EncodePoint(frame_from_layer * geometry.CentreOf(frontier.viewpoint->cell),
              message->mutable_viewpoint());
  message->set_gain_cells(frontier.viewpoint->gain_cells);
}

}  // namespace hypermap::wire
