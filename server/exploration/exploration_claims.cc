// The calls of MapExplorations that concern goals: Claim, Renew and Release.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/robots/robot_report.h"
#include "server/exploration/map_explorations.h"
#include "server/session/map_session.h"

namespace hypermap::server {
namespace {

// Edits of a claim beyond which it removes no more unreachable places; later claims remove the
// rest. A large batch would hold up the map's writer.
constexpr size_t kMaxEdits = 1'000;

absl::Status NotHeld(const std::string& robot, ObjectId goal_id) {
  return absl::NotFoundError(absl::StrCat("robot \"", robot, "\" does not hold goal ", goal_id));
}

absl::Status CheckLease(absl::Duration lease) {
  if (lease > absl::ZeroDuration() && lease <= FixedLimits::kMaxLease) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("lease must be positive and at most ",
                                                 absl::FormatDuration(FixedLimits::kMaxLease)));
}

PutObject PutGoal(const ExplorationGoal& goal, absl::Duration lease) {
  PutObject put{kExplorationsLayer, ToObject(goal), ""};
  put.time_to_live = lease;
  return put;
}

DeleteObject Remove(ObjectId id) { return {kExplorationsLayer, id, {}}; }

}  // namespace

absl::StatusOr<MapExplorations::Kept> MapExplorations::ReadGoal(const std::string& robot,
                                                                ObjectId goal_id,
                                                                ExplorationGoal* goal) const {
  const SnapshotPtr snapshot = session_->snapshot();
  HYPERMAP_RETURN_IF_ERROR(snapshot->CheckUndamaged({kExplorationsLayer}));
  const auto* layer = snapshot->FindSemantic(kExplorationsLayer);
  const ObjectPtr object = layer == nullptr ? nullptr : layer->Find(goal_id);
  if (!object || object->label != kGoalLabel) return NotHeld(robot, goal_id);
  HYPERMAP_ASSIGN_OR_RETURN(const ExplorationGoal found, ToGoal(*object));
  absl::StatusOr<Kept> kept = Read(found.exploration_id);
  if (absl::IsNotFound(kept.status())) return NotHeld(robot, goal_id);
  HYPERMAP_RETURN_IF_ERROR(kept.status());
  for (const ExplorationGoal& held : kept->objects.goals) {
    if (held.id != goal_id || held.robot != robot || !IsActive(kept->objects.exploration)) continue;
    *goal = held;
    return kept;
  }
  return NotHeld(robot, goal_id);
}

absl::StatusOr<ClaimAnswer> MapExplorations::Claim(const GoalClaim& request) {
  HYPERMAP_RETURN_IF_ERROR(CheckRobotName(request.robot));
  HYPERMAP_RETURN_IF_ERROR(CheckLease(request.lease));
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryClaim(request);
  });
}

absl::StatusOr<ClaimAnswer> MapExplorations::TryClaim(const GoalClaim& request) {
  HYPERMAP_ASSIGN_OR_RETURN(Kept kept, Read(request.exploration_id));
  const Exploration& exploration = kept.objects.exploration;
  ClaimAnswer answer;
  absl::Status status =
      SetFrame(*kept.snapshot, kept.layer->spec().frame_id, request.frame_id, &answer);
  HYPERMAP_RETURN_IF_ERROR(status);
  answer.exploration_id = exploration.id;
  answer.state = exploration.state;
  answer.end_reason = exploration.end_reason;
  if (!IsActive(exploration)) return answer;

  HYPERMAP_ASSIGN_OR_RETURN(Active* const active, Follow(kept));
  ExplorationFollower& follower = active->follower;
  status = Meet(request, answer.frame_from_layer, active);
  HYPERMAP_RETURN_IF_ERROR(status);
  answer.goal = ChooseGoal(request.robot, kept.objects, active);
  const EndReason reason = answer.goal
                               ? EndReason::kNone
                               : active->team.ReasonToEnd(request.robot, kept.objects, &follower);
  const ExplorationProgress progress = Measure(active);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());

  std::vector<Edit> edits;
  if (answer.goal) edits.push_back(PutGoal(*answer.goal, request.lease));
  for (const UnreachablePlace& place : kept.objects.unreachable_places) {
    if (edits.size() >= kMaxEdits) break;
    if (follower.MayBeReachableAgain(place)) edits.push_back(Remove(place.id));
  }
  if (reason != EndReason::kNone) {
    End(reason, &kept, &edits);
  } else {
    for (const ExplorationGoal& goal : kept.objects.goals) {
      if (goal.robot == request.robot) edits.push_back(Remove(goal.id));
    }
  }
  if (edits.empty()) return answer;
  answer.num_edits = static_cast<int64_t>(edits.size());
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                            Commit(kept, std::move(edits), request.author));
  answer.revision = receipt.revision;
  answer.state = exploration.state;
  answer.end_reason = exploration.end_reason;
  if (answer.goal) answer.goal = AsPut(*answer.goal, receipt.object_ids.front(), request.lease);
  if (!IsActive(exploration)) {
    active_.erase(exploration.id);
    Remember(exploration.id, progress);
  }
  return answer;
}

absl::Status MapExplorations::Meet(const GoalClaim& request,
                                   const PlanarTransform& frame_from_layer, Active* active) {
  const Point place = frame_from_layer.ApplyInverse(request.place);
  if (!active->follower.CanStand(place)) {
    return absl::FailedPreconditionError(absl::StrCat("robot \"", request.robot,
                                                      "\" stands where it cannot go: (",
                                                      request.place.x, ", ", request.place.y, ")"));
  }
  const bool met = active->team.Meet(request.robot, place, PassedTime(), &active->follower);
  if (met) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("at most ", FixedLimits::kMaxRobots, " robots explore an area together"));
}

std::optional<ExplorationGoal> MapExplorations::ChooseGoal(const std::string& robot,
                                                           const ExplorationObjects& objects,
                                                           Active* active) {
  const std::optional<Explorer::ChosenViewpoint> chosen =
      active->team.Choose(robot, objects, &active->follower);
  if (!chosen) return std::nullopt;
  ExplorationGoal goal;
  goal.exploration_id = objects.exploration.id;
  goal.robot = robot;
  goal.cell = active->follower.SquareOf(chosen->viewpoint.cell);
  goal.gain_cells = chosen->viewpoint.gain_cells;
  goal.path_length_m = chosen->path_m;
  return goal;
}

ExplorationGoal MapExplorations::AsPut(ExplorationGoal goal, ObjectId id,
                                       absl::Duration lease) const {
  goal.id = id;
  const SnapshotPtr snapshot = session_->snapshot();
  const auto* layer = snapshot->FindSemantic(kExplorationsLayer);
  const ObjectPtr object = layer == nullptr ? nullptr : layer->Find(id);
  goal.expires_at = object ? object->expires_at : session_->time().Now() + lease;
  return goal;
}

absl::StatusOr<GoalAnswer> MapExplorations::Renew(const GoalRenewal& request) {
  HYPERMAP_RETURN_IF_ERROR(CheckRobotName(request.robot));
  HYPERMAP_RETURN_IF_ERROR(CheckLease(request.lease));
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryRenew(request);
  });
}

absl::StatusOr<GoalAnswer> MapExplorations::TryRenew(const GoalRenewal& request) {
  GoalAnswer answer;
  HYPERMAP_ASSIGN_OR_RETURN(const Kept kept,
                            ReadGoal(request.robot, request.goal_id, &answer.goal));
  HYPERMAP_RETURN_IF_ERROR(SetFrame(*kept.snapshot, kept.layer->spec().frame_id, "", &answer));
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                            Commit(kept, {PutGoal(answer.goal, request.lease)}, request.author));
  answer.revision = receipt.revision;
  answer.num_edits = 1;
  answer.goal = AsPut(answer.goal, request.goal_id, request.lease);
  return answer;
}

absl::StatusOr<ExplorationAnswer> MapExplorations::Release(const GoalRelease& request) {
  HYPERMAP_RETURN_IF_ERROR(CheckRobotName(request.robot));
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryRelease(request);
  });
}

absl::StatusOr<ExplorationAnswer> MapExplorations::TryRelease(const GoalRelease& request) {
  ExplorationGoal goal;
  HYPERMAP_ASSIGN_OR_RETURN(const Kept kept, ReadGoal(request.robot, request.goal_id, &goal));
  HYPERMAP_ASSIGN_OR_RETURN(Active* const active, Follow(kept));
  std::vector<Edit> edits{Remove(goal.id)};
  if (request.outcome == GoalOutcome::kUnreachable) {
    const Exploration& exploration = kept.objects.exploration;
    UnreachablePlace place{0, exploration.id, goal.robot, goal.cell, 0};
    place.occupancy_version = kept.snapshot->LayerVersionOf(exploration.occupancy_layer);
    edits.push_back(PutObject{kExplorationsLayer, ToObject(place), ""});
  }
  ExplorationAnswer answer;
  answer.num_edits = static_cast<int64_t>(edits.size());
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                            Commit(kept, std::move(edits), request.author));
  answer.revision = receipt.revision;
  if (request.outcome == GoalOutcome::kReached) {
    ExplorationFollower& follower = active->follower;
    const std::optional<CellIndex> cell = follower.CellAt(Centroid(goal.cell));
    if (cell) follower.explorer().LookedRound(*cell);
  }
  Measure(active);
  return answer;
}

}  // namespace hypermap::server
