// The calls of ExplorationDesk that concern goals: Claim, Renew and Release.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/exploration/exploration_desk.h"
#include "server/session/map_session.h"

namespace hypermap::server {
namespace {

constexpr size_t kMaxRobotLength = 128;

absl::Status NotHeld(const std::string& robot, ObjectId goal_id) {
  return absl::NotFoundError(absl::StrCat("robot \"", robot, "\" does not hold goal ", goal_id));
}

absl::Status CheckRobot(const std::string& robot) {
  if (!robot.empty() && robot.size() <= kMaxRobotLength) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("robot must have 1 to ", kMaxRobotLength, " characters"));
}

absl::Status CheckLease(absl::Duration lease) {
  if (lease > absl::ZeroDuration() && lease <= kMaxLease) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("lease must be positive and at most ", absl::FormatDuration(kMaxLease)));
}

PutObject PutGoal(const ExplorationGoal& goal, absl::Duration lease) {
  PutObject put{kExplorationsLayer, ToObject(goal), ""};
  put.time_to_live = lease;
  return put;
}

DeleteObject Remove(ObjectId id) { return {kExplorationsLayer, id, {}}; }

}  // namespace

absl::StatusOr<ExplorationDesk::Kept> ExplorationDesk::ReadGoal(const std::string& robot,
                                                                ObjectId goal_id,
                                                                ExplorationGoal* goal) const {
  const SnapshotPtr snapshot = session_->snapshot();
  const auto* layer = snapshot->FindSemantic(kExplorationsLayer);
  const ObjectPtr object = layer == nullptr ? nullptr : layer->Find(goal_id);
  if (!object || object->label != kGoalLabel) return NotHeld(robot, goal_id);
  const absl::StatusOr<ExplorationGoal> found = ToGoal(*object);
  if (!found.ok()) return found.status();
  absl::StatusOr<Kept> kept = Read(found->exploration_id);
  if (absl::IsNotFound(kept.status())) return NotHeld(robot, goal_id);
  if (!kept.ok()) return kept.status();
  for (const ExplorationGoal& held : kept->objects.goals) {
    if (held.id != goal_id || held.robot != robot || !IsActive(kept->objects.exploration)) continue;
    *goal = held;
    return kept;
  }
  return NotHeld(robot, goal_id);
}

absl::StatusOr<ClaimAnswer> ExplorationDesk::Claim(const ClaimOrder& order) {
  if (auto status = CheckRobot(order.robot); !status.ok()) return status;
  if (auto status = CheckLease(order.lease); !status.ok()) return status;
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryClaim(order);
  });
}

absl::StatusOr<ClaimAnswer> ExplorationDesk::TryClaim(const ClaimOrder& order) {
  absl::StatusOr<Kept> kept = Read(order.exploration_id);
  if (!kept.ok()) return kept.status();
  const Exploration& exploration = kept->objects.exploration;
  ClaimAnswer answer;
  absl::Status status =
      SetFrame(*kept->snapshot, kept->layer->spec().frame_id, order.frame_id, &answer);
  if (!status.ok()) return status;
  answer.exploration_id = exploration.id;
  answer.state = exploration.state;
  answer.end_reason = exploration.end_reason;
  if (!IsActive(exploration)) return answer;

  const absl::StatusOr<Active*> active = Follow(*kept);
  if (!active.ok()) return active.status();
  ExplorationFollower& follower = (*active)->follower;
  status = Meet(order, answer.frame_from_layer, *active);
  if (!status.ok()) return status;
  answer.goal = ChooseGoal(order.robot, kept->objects, *active);
  const EndReason reason = answer.goal
                               ? EndReason::kNone
                               : (*active)->team.ReasonToEnd(order.robot, kept->objects, &follower);
  const ExplorationProgress progress = Measure(*active);

  std::vector<Edit> edits;
  if (answer.goal) edits.push_back(PutGoal(*answer.goal, order.lease));
  for (const UnreachablePlace& place : kept->objects.unreachable_places) {
    if (follower.MayBeReachableAgain(place)) edits.push_back(Remove(place.id));
  }
  if (reason != EndReason::kNone) {
    End(reason, &*kept, &edits);
  } else {
    for (const ExplorationGoal& goal : kept->objects.goals) {
      if (goal.robot == order.robot) edits.push_back(Remove(goal.id));
    }
  }
  if (edits.empty()) return answer;
  answer.num_edits = static_cast<int64_t>(edits.size());
  const absl::StatusOr<storage::Receipt> receipt = Commit(*kept, std::move(edits), order.author);
  if (!receipt.ok()) return receipt.status();
  answer.revision = receipt->revision;
  answer.state = exploration.state;
  answer.end_reason = exploration.end_reason;
  if (answer.goal) answer.goal = AsPut(*answer.goal, receipt->object_ids.front(), order.lease);
  if (!IsActive(exploration)) {
    active_.erase(exploration.id);
    Remember(exploration.id, progress);
  }
  return answer;
}

absl::Status ExplorationDesk::Meet(const ClaimOrder& order, const PlanarTransform& frame_from_layer,
                                   Active* active) {
  const Point place = frame_from_layer.ApplyInverse(order.place);
  if (!active->follower.CanStand(place)) {
    return absl::FailedPreconditionError(absl::StrCat("robot \"", order.robot,
                                                      "\" stands where it cannot go: (",
                                                      order.place.x, ", ", order.place.y, ")"));
  }
  const absl::Time now = session_->options().clock();
  if (active->team.Meet(order.robot, place, now, &active->follower)) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("at most ", ExplorationTeam::kMaxRobots, " robots explore an area together"));
}

std::optional<ExplorationGoal> ExplorationDesk::ChooseGoal(const std::string& robot,
                                                           const ExplorationObjects& objects,
                                                           Active* active) {
  const std::optional<Explorer::Goal> chosen =
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

ExplorationGoal ExplorationDesk::AsPut(ExplorationGoal goal, ObjectId id,
                                       absl::Duration lease) const {
  goal.id = id;
  const SnapshotPtr snapshot = session_->snapshot();
  const auto* layer = snapshot->FindSemantic(kExplorationsLayer);
  const ObjectPtr object = layer == nullptr ? nullptr : layer->Find(id);
  goal.expires_at = object ? object->expires_at : session_->options().clock() + lease;
  return goal;
}

absl::StatusOr<GoalAnswer> ExplorationDesk::Renew(const RenewOrder& order) {
  if (auto status = CheckRobot(order.robot); !status.ok()) return status;
  if (auto status = CheckLease(order.lease); !status.ok()) return status;
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryRenew(order);
  });
}

absl::StatusOr<GoalAnswer> ExplorationDesk::TryRenew(const RenewOrder& order) {
  GoalAnswer answer;
  const absl::StatusOr<Kept> kept = ReadGoal(order.robot, order.goal_id, &answer.goal);
  if (!kept.ok()) return kept.status();
  absl::Status status = SetFrame(*kept->snapshot, kept->layer->spec().frame_id, "", &answer);
  if (!status.ok()) return status;
  const absl::StatusOr<storage::Receipt> receipt =
      Commit(*kept, {PutGoal(answer.goal, order.lease)}, order.author);
  if (!receipt.ok()) return receipt.status();
  answer.revision = receipt->revision;
  answer.num_edits = 1;
  answer.goal = AsPut(answer.goal, order.goal_id, order.lease);
  return answer;
}

absl::StatusOr<ExplorationAnswer> ExplorationDesk::Release(const ReleaseOrder& order) {
  if (auto status = CheckRobot(order.robot); !status.ok()) return status;
  MutexLock lock(&mutex_);
  return Retried([&] {
    mutex_.AssertHeld();
    return TryRelease(order);
  });
}

absl::StatusOr<ExplorationAnswer> ExplorationDesk::TryRelease(const ReleaseOrder& order) {
  ExplorationGoal goal;
  const absl::StatusOr<Kept> kept = ReadGoal(order.robot, order.goal_id, &goal);
  if (!kept.ok()) return kept.status();
  const absl::StatusOr<Active*> active = Follow(*kept);
  if (!active.ok()) return active.status();
  std::vector<Edit> edits{Remove(goal.id)};
  if (order.outcome == GoalOutcome::kUnreachable) {
    const Exploration& exploration = kept->objects.exploration;
    UnreachablePlace place{0, exploration.id, goal.robot, goal.cell, 0};
    place.occupancy_version = kept->snapshot->LayerVersionOf(exploration.occupancy_layer);
    edits.push_back(PutObject{kExplorationsLayer, ToObject(place), ""});
  }
  ExplorationAnswer answer;
  answer.num_edits = static_cast<int64_t>(edits.size());
  const absl::StatusOr<storage::Receipt> receipt = Commit(*kept, std::move(edits), order.author);
  if (!receipt.ok()) return receipt.status();
  answer.revision = receipt->revision;
  if (order.outcome == GoalOutcome::kReached) {
    ExplorationFollower& follower = (*active)->follower;
    const std::optional<CellIndex> cell = follower.CellAt(Centroid(goal.cell));
    if (cell) follower.explorer().LookedRound(*cell);
  }
  Measure(*active);
  return answer;
}

}  // namespace hypermap::server
