// Explorations of Client.
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "wire/exploration.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/time.h"

namespace hypermap::client {
namespace {

absl::StatusOr<Goal> DecodeGoal(const v1::Goal& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const Point position,
                            wire::DecodePoint("goal.position", message.position()));
  return Goal{
      message.id(),         message.robot(),         position,
      message.gain_cells(), message.path_length_m(), wire::DecodeTime(message.expire_time())};
}

absl::Status DecodePlaces(const v1::Exploration& message, ExplorationEntry* entry) {
  for (const v1::Goal& encoded : message.goals()) {
    HYPERMAP_ASSIGN_OR_RETURN(Goal goal, DecodeGoal(encoded));
    entry->goals.push_back(std::move(goal));
  }
  for (const v1::UnreachablePlace& place : message.unreachable_places()) {
    HYPERMAP_ASSIGN_OR_RETURN(const Point position,
                              wire::DecodePoint("unreachable_place.position", place.position()));
    entry->unreachable_places.push_back({place.id(), place.robot(), position});
  }
  return absl::OkStatus();
}

absl::StatusOr<ExplorationEntry> DecodeEntry(const v1::Exploration& message) {
  HYPERMAP_ASSIGN_OR_RETURN(Exploration exploration,
                            wire::DecodeExploration("exploration", message));
  ExplorationEntry entry{std::move(exploration), {}, {}};
  HYPERMAP_RETURN_IF_ERROR(DecodePlaces(message, &entry));
  return entry;
}

ExplorationProgress DecodeProgress(const v1::ExplorationProgress& message) {
  return {message.explored_cells(), message.reachable_cells(), message.unreachable_cells(),
          message.fraction(),       message.rate_m2_per_s(),   message.cell_area_m2()};
}

absl::StatusOr<FrontierEntry> DecodeFrontier(const v1::Frontier& message) {
  FrontierEntry entry;
  entry.num_cells = message.num_cells();
  entry.gain_cells = message.gain_cells();
  HYPERMAP_ASSIGN_OR_RETURN(const Point centroid,
                            wire::DecodePoint("frontier.centroid", message.centroid()));
  entry.centroid = centroid;
  if (message.has_viewpoint()) {
    HYPERMAP_ASSIGN_OR_RETURN(const Point viewpoint,
                              wire::DecodePoint("frontier.viewpoint", message.viewpoint()));
    entry.viewpoint = viewpoint;
  }
  entry.cells.reserve(message.cells_size());
  for (const v1::Point& cell : message.cells()) {
    HYPERMAP_ASSIGN_OR_RETURN(const Point centre, wire::DecodePoint("frontier.cells", cell));
    entry.cells.push_back(centre);
  }
  return entry;
}

}  // namespace

absl::StatusOr<StartAnswer> Client::StartExploration(const std::string& map, const Polygon& area,
                                                     const std::string& occupancy_layer,
                                                     const std::string& exploration_layer,
                                                     const StartOptions& start_options,
                                                     const CallOptions& options) {
  v1::StartExplorationRequest request;
  request.set_map(map);
  wire::EncodePolygon(area, request.mutable_area());
  request.set_frame_id(start_options.frame_id);
  request.set_occupancy_layer(occupancy_layer);
  request.set_exploration_layer(exploration_layer);
  request.set_explored_rule(wire::EncodeCellRule(start_options.explored_rule));
  request.set_robot_radius_m(start_options.robot_radius_m);
  request.set_range_m(start_options.range_m);
  request.set_min_gain_cells(start_options.min_gain_cells);
  request.set_request_id(RequestIdOf(options));
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::StartExploration,
                        request, options));
  absl::StatusOr<ExplorationEntry> entry = DecodeEntry(response.exploration());
  if (!entry.ok()) return BadAnswer(entry.status());
  return StartAnswer{response.revision(), *std::move(entry)};
}

absl::StatusOr<ExplorationAnswer> Client::GetExploration(const std::string& map,
                                                         ObjectId exploration,
                                                         const std::string& frame_id,
                                                         const CallOptions& options) {
  v1::GetExplorationRequest request;
  request.set_map(map);
  request.set_exploration_id(exploration);
  request.set_frame_id(frame_id);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::GetExploration,
                        request, options));
  absl::StatusOr<ExplorationEntry> entry = DecodeEntry(response.exploration());
  if (!entry.ok()) return BadAnswer(entry.status());
  return ExplorationAnswer{response.revision(), response.frame_id(), *std::move(entry),
                           DecodeProgress(response.progress())};
}

absl::StatusOr<ExplorationList> Client::ListExplorations(const std::string& map,
                                                         const std::string& frame_id,
                                                         const CallOptions& options) {
  v1::ListExplorationsRequest request;
  request.set_map(map);
  request.set_frame_id(frame_id);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::ListExplorations,
                        request, options));
  ExplorationList list{response.revision(), response.frame_id(), {}};
  for (const v1::Exploration& message : response.explorations()) {
    absl::StatusOr<ExplorationEntry> entry = DecodeEntry(message);
    if (!entry.ok()) return BadAnswer(entry.status());
    list.explorations.push_back(*std::move(entry));
  }
  return list;
}

absl::StatusOr<FrontierList> Client::ListFrontiers(const std::string& map, ObjectId exploration,
                                                   const std::string& frame_id, bool with_cells,
                                                   const CallOptions& options) {
  v1::ListFrontiersRequest request;
  request.set_map(map);
  request.set_exploration_id(exploration);
  request.set_frame_id(frame_id);
  request.set_with_cells(with_cells);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::ListFrontiers,
                        request, options));
  FrontierList list{response.revision(), response.frame_id(), response.exploration_id(), {}};
  for (const v1::Frontier& message : response.frontiers()) {
    absl::StatusOr<FrontierEntry> frontier = DecodeFrontier(message);
    if (!frontier.ok()) return BadAnswer(frontier.status());
    list.frontiers.push_back(*std::move(frontier));
  }
  return list;
}

// ClaimGoal, RenewGoal and ReleaseGoal have no request id, and still may be retried: a second claim
// gives back what the first one got, and a second release finds no goal.
absl::StatusOr<ClaimAnswer> Client::ClaimGoal(const std::string& map, const std::string& robot,
                                              const Point& position,
                                              const ClaimOptions& claim_options,
                                              const CallOptions& options) {
  v1::ClaimGoalRequest request;
  request.set_map(map);
  request.set_exploration_id(claim_options.exploration_id);
  request.set_robot(robot);
  wire::EncodePose(PlanarTransform(position.x, position.y, 0.0), request.mutable_pose());
  request.set_frame_id(claim_options.frame_id);
  wire::EncodeDuration(claim_options.lease, request.mutable_lease());
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::ClaimGoal,
                        request, options));
  ClaimAnswer answer{.revision = response.revision(), .exploration_id = response.exploration_id()};
  const absl::StatusOr<ExplorationState> state =
      wire::DecodeExplorationState("state", response.state());
  if (!state.ok()) return BadAnswer(state.status());
  answer.state = *state;
  const absl::StatusOr<EndReason> reason =
      wire::DecodeEndReason("end_reason", response.end_reason());
  if (!reason.ok()) return BadAnswer(reason.status());
  answer.end_reason = *reason;
  if (!response.has_goal()) return answer;
  absl::StatusOr<Goal> goal = DecodeGoal(response.goal());
  if (!goal.ok()) return BadAnswer(goal.status());
  answer.goal = *std::move(goal);
  return answer;
}

absl::StatusOr<Goal> Client::RenewGoal(const std::string& map, const std::string& robot,
                                       ObjectId goal, absl::Duration lease,
                                       const CallOptions& options) {
  v1::RenewGoalRequest request;
  request.set_map(map);
  request.set_robot(robot);
  request.set_goal_id(goal);
  wire::EncodeDuration(lease, request.mutable_lease());
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::RenewGoal,
                        request, options));
  absl::StatusOr<Goal> renewed = DecodeGoal(response.goal());
  if (!renewed.ok()) return BadAnswer(renewed.status());
  return renewed;
}

absl::StatusOr<Revision> Client::ReleaseGoal(const std::string& map, const std::string& robot,
                                             ObjectId goal, GoalOutcome outcome,
                                             const CallOptions& options) {
  v1::ReleaseGoalRequest request;
  request.set_map(map);
  request.set_robot(robot);
  request.set_goal_id(goal);
  request.set_outcome(wire::EncodeGoalOutcome(outcome));
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::ReleaseGoal,
                        request, options));
  return response.revision();
}

absl::StatusOr<ExplorationEntry> Client::StopExploration(const std::string& map,
                                                         ObjectId exploration,
                                                         const CallOptions& options) {
  v1::StopExplorationRequest request;
  request.set_map(map);
  request.set_exploration_id(exploration);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(connection_->exploration(), &v1::ExplorationService::Stub::StopExploration,
                        request, options));
  absl::StatusOr<ExplorationEntry> entry = DecodeEntry(response.exploration());
  if (!entry.ok()) return BadAnswer(entry.status());
  return entry;
}

}  // namespace hypermap::client
