#include "wire/exploration_requests.h"

#include <utility>

#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "wire/exploration.h"
#include "wire/field.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/time.h"

namespace hypermap::wire {
namespace {

// Decodes the lease of a request; kDefaultLease if it has none.
template <typename Request>
absl::StatusOr<absl::Duration> DecodeLease(const Request& message) {
  if (!message.has_lease()) return kDefaultLease;
  return DecodeDuration("lease", message.lease());
}

}  // namespace

void EncodeStart(const ExplorationStart& start, v1::StartExplorationRequest* message) {
  EncodePolygon(start.area, message->mutable_area());
  message->set_frame_id(start.frame_id);
  message->set_occupancy_layer(start.occupancy_layer);
  message->set_exploration_layer(start.exploration_layer);
  message->set_explored_rule(EncodeCellRule(start.explored_rule));
  message->set_robot_radius_m(start.robot_radius_m);
  message->set_range_m(start.range_m);
  message->set_min_gain_cells(start.min_gain_cells);
  message->set_request_id(start.request_id);
}

absl::StatusOr<ExplorationStart> DecodeStart(const v1::StartExplorationRequest& message,
                                             const Limits& limits) {
  if (!message.has_area()) return InvalidField("area", "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(Polygon area, DecodeQuestionArea("area", message.area(), limits));
  HYPERMAP_ASSIGN_OR_RETURN(const CellRule rule,
                            DecodeCellRule("explored_rule", message.explored_rule()));
  ExplorationStart start;
  start.area = std::move(area);
  start.frame_id = message.frame_id();
  start.occupancy_layer = message.occupancy_layer();
  start.exploration_layer = message.exploration_layer();
  start.explored_rule = rule;
  start.robot_radius_m = message.robot_radius_m();
  if (message.range_m() != 0.0) start.range_m = message.range_m();
  if (message.min_gain_cells() != 0) start.min_gain_cells = message.min_gain_cells();
  start.request_id = message.request_id();
  return start;
}

void EncodeClaim(const GoalClaim& claim, v1::ClaimGoalRequest* message) {
  message->set_exploration_id(claim.exploration_id);
  message->set_robot(claim.robot);
  EncodePose(PlanarTransform(claim.place.x, claim.place.y, 0.0), message->mutable_pose());
  message->set_frame_id(claim.frame_id);
  EncodeDuration(claim.lease, message->mutable_lease());
}

absl::StatusOr<GoalClaim> DecodeClaim(const v1::ClaimGoalRequest& message) {
  if (!message.has_pose()) return InvalidField("pose", "is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform pose, DecodePose("pose", message.pose()));
  HYPERMAP_ASSIGN_OR_RETURN(const absl::Duration lease, DecodeLease(message));
  GoalClaim claim;
  claim.exploration_id = message.exploration_id();
  claim.robot = message.robot();
  claim.place = {pose.x(), pose.y()};
  claim.frame_id = message.frame_id();
  claim.lease = lease;
  return claim;
}

void EncodeRenewal(const GoalRenewal& renewal, v1::RenewGoalRequest* message) {
  message->set_robot(renewal.robot);
  message->set_goal_id(renewal.goal_id);
  EncodeDuration(renewal.lease, message->mutable_lease());
}

absl::StatusOr<GoalRenewal> DecodeRenewal(const v1::RenewGoalRequest& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const absl::Duration lease, DecodeLease(message));
  return GoalRenewal{message.robot(), message.goal_id(), lease, ""};
}

void EncodeRelease(const GoalRelease& release, v1::ReleaseGoalRequest* message) {
  message->set_robot(release.robot);
  message->set_goal_id(release.goal_id);
  message->set_outcome(EncodeGoalOutcome(release.outcome));
}

absl::StatusOr<GoalRelease> DecodeRelease(const v1::ReleaseGoalRequest& message) {
  HYPERMAP_ASSIGN_OR_RETURN(const GoalOutcome outcome,
                            DecodeGoalOutcome("outcome", message.outcome()));
  return GoalRelease{message.robot(), message.goal_id(), outcome, ""};
}

}  // namespace hypermap::wire
