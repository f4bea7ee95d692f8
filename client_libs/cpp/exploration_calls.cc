// Explorations of Client.
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "wire/exploration.h"
#include "wire/exploration_requests.h"

namespace hypermap::client {
namespace {

absl::StatusOr<ExplorationEntry> DecodeEntry(const v1::Exploration& message) {
  absl::StatusOr<ExplorationEntry> entry = wire::DecodeExploration("exploration", message);
  if (!entry.ok()) return BadAnswer(entry.status());
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
  wire::EncodeStart({.area = area,
                     .frame_id = start_options.frame_id,
                     .occupancy_layer = occupancy_layer,
                     .exploration_layer = exploration_layer,
                     .explored_rule = start_options.explored_rule,
                     .robot_radius_m = start_options.robot_radius_m,
                     .range_m = start_options.range_m,
                     .min_gain_cells = start_options.min_gain_cells,
                     .author = "",
                     .request_id = RequestIdOf(options)},
                    &request);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::ExplorationService::Stub::StartExploration, request, options));
  HYPERMAP_ASSIGN_OR_RETURN(ExplorationEntry entry, DecodeEntry(response.exploration()));
  return StartAnswer{response.revision(), std::move(entry), response.incarnation()};
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
      connection_->Call(&v1::ExplorationService::Stub::GetExploration, request, options));
  HYPERMAP_ASSIGN_OR_RETURN(ExplorationEntry entry, DecodeEntry(response.exploration()));
  return ExplorationAnswer{response.revision(), response.frame_id(), std::move(entry),
                           wire::DecodeProgress(response.progress()), response.incarnation()};
}

absl::StatusOr<ExplorationList> Client::ListExplorations(const std::string& map,
                                                         const std::string& frame_id,
                                                         const CallOptions& options) {
  v1::ListExplorationsRequest request;
  request.set_map(map);
  request.set_frame_id(frame_id);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::ExplorationService::Stub::ListExplorations, request, options));
  ExplorationList list{response.revision(), response.frame_id(), {}, response.incarnation()};
  for (const v1::Exploration& message : response.explorations()) {
    HYPERMAP_ASSIGN_OR_RETURN(ExplorationEntry entry, DecodeEntry(message));
    list.explorations.push_back(std::move(entry));
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
      connection_->Call(&v1::ExplorationService::Stub::ListFrontiers, request, options));
  FrontierList list{response.revision(),
                    response.frame_id(),
                    response.exploration_id(),
                    {},
                    response.incarnation()};
  for (const v1::Frontier& message : response.frontiers()) {
    absl::StatusOr<FrontierEntry> frontier = wire::DecodeFrontier("frontier", message);
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
  wire::EncodeClaim({.exploration_id = claim_options.exploration_id,
                     .robot = robot,
                     .place = position,
                     .frame_id = claim_options.frame_id,
                     .lease = claim_options.lease,
                     .author = ""},
                    &request);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::ExplorationService::Stub::ClaimGoal, request, options));
  absl::StatusOr<ClaimResult> result = wire::DecodeClaimResult(response);
  if (!result.ok()) return BadAnswer(result.status());
  return ClaimAnswer{*std::move(result), response.revision(), response.incarnation()};
}

absl::StatusOr<LeasedGoal> Client::RenewGoal(const std::string& map, const std::string& robot,
                                             ObjectId goal, absl::Duration lease,
                                             const CallOptions& options) {
  v1::RenewGoalRequest request;
  request.set_map(map);
  wire::EncodeRenewal({robot, goal, lease, /*author=*/""}, &request);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::ExplorationService::Stub::RenewGoal, request, options));
  absl::StatusOr<LeasedGoal> renewed = wire::DecodeGoal("goal", response.goal());
  if (!renewed.ok()) return BadAnswer(renewed.status());
  return renewed;
}

absl::StatusOr<Revision> Client::ReleaseGoal(const std::string& map, const std::string& robot,
                                             ObjectId goal, GoalOutcome outcome,
                                             const CallOptions& options) {
  v1::ReleaseGoalRequest request;
  request.set_map(map);
  wire::EncodeRelease({robot, goal, outcome, /*author=*/""}, &request);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::ExplorationService::Stub::ReleaseGoal, request, options));
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
      connection_->Call(&v1::ExplorationService::Stub::StopExploration, request, options));
  return DecodeEntry(response.exploration());
}

}  // namespace hypermap::client
