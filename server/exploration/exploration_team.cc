#include "server/exploration/exploration_team.h"

#include <algorithm>
#include <cstdint>

#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"

namespace hypermap::server {
namespace {

// An exploration does not wait for a robot whose last claim is longer ago than this.
constexpr absl::Duration kAbsence = absl::Minutes(10);
// Distance from an unreachable place within which no goal is chosen: a robot that can't get there
// can't get next to it either.
constexpr double kAvoided_m = 0.5;

// Sets the cells of `marked` to 1 that are within `radius` cells of `centre`.
void MarkDisc(const CellIndex& centre, double radius, CellRaster<uint8_t>* marked) {
  const auto reach = static_cast<int32_t>(radius);
  for (int32_t row = -reach; row <= reach; ++row) {
    for (int32_t col = -reach; col <= reach; ++col) {
      const CellIndex cell{centre.row + row, centre.col + col};
      if (row * row + col * col <= radius * radius && marked->Contains(cell)) marked->set(cell, 1);
    }
  }
}

// Marks the cells at and near unreachable places, to which no robot is sent. Means nothing if
// IsCancelled().
CellRaster<uint8_t> GivenUp(const ExplorationObjects& objects,
                            const ExplorationFollower& follower) {
  if (objects.unreachable_places.empty()) return {};
  // In cells. Bounds the time on a very fine grid.
  constexpr double kMaxRadius = 32.0;
  const double radius = std::min(kAvoided_m / follower.geometry().resolution_m, kMaxRadius);
  CellRaster<uint8_t> marked(follower.explorer().box());
  for (const UnreachablePlace& place : objects.unreachable_places) {
    if (IsCancelled()) break;
    if (follower.MayBeReachableAgain(place)) continue;
    const std::optional<CellIndex> cell = follower.CellAt(Centroid(place.cell));
    if (cell) MarkDisc(*cell, radius, &marked);
  }
  return marked;
}

std::vector<CellIndex> GoalsOfOthers(const std::string& robot, const ExplorationObjects& objects,
                                     const ExplorationFollower& follower) {
  std::vector<CellIndex> cells;
  for (const ExplorationGoal& goal : objects.goals) {
    if (goal.robot == robot) continue;
    const std::optional<CellIndex> cell = follower.CellAt(Centroid(goal.cell));
    if (cell) cells.push_back(*cell);
  }
  return cells;
}

}  // namespace

bool ExplorationTeam::Meet(const std::string& robot, const Point& place, absl::Time now,
                           ExplorationFollower* follower) {
  if (robots_.size() >= FixedLimits::kMaxRobots && !robots_.contains(robot)) {
    std::erase_if(robots_, [now](const auto& met) { return now - met.second.at > kAbsence; });
    if (robots_.size() >= FixedLimits::kMaxRobots) return false;
  }
  robots_[robot] = {place, now};
  const bool knows_others = told_generation_ == follower->generation();
  for (const auto& [name, met] : robots_) {
    if (knows_others && name != robot) continue;
    const std::optional<CellIndex> cell = follower->CellAt(met.place);
    if (cell) follower->explorer().AddRobot(*cell);
  }
  // The follower may not know all robots yet if this call is given up: the next one tells it again.
  if (!IsCancelled()) told_generation_ = follower->generation();
  return true;
}

std::optional<Explorer::ChosenViewpoint> ExplorationTeam::Choose(
    const std::string& robot, const ExplorationObjects& objects,
    ExplorationFollower* follower) const {
  const std::optional<CellIndex> cell = follower->CellAt(robots_.at(robot).place);
  if (!cell) return std::nullopt;
  return follower->explorer().ChooseViewpoint(*cell, GoalsOfOthers(robot, objects, *follower),
                                              GivenUp(objects, *follower));
}

EndReason ExplorationTeam::ReasonToEnd(const std::string& robot, const ExplorationObjects& objects,
                                       ExplorationFollower* follower) const {
  if (!GoalsOfOthers(robot, objects, *follower).empty()) return EndReason::kNone;
  Explorer& explorer = follower->explorer();
  const absl::Time lately = robots_.at(robot).at - kAbsence;
  const auto is_anything_left = [&](absl::Time met_since, const CellRaster<uint8_t>& avoided) {
    std::vector<CellIndex> cells;
    for (const auto& [name, met] : robots_) {
      const std::optional<CellIndex> cell = follower->CellAt(met.place);
      if (met.at >= met_since && cell) cells.push_back(*cell);
    }
    return explorer.IsAnythingLeft(cells, avoided);
  };
  if (is_anything_left(lately, GivenUp(objects, *follower))) return EndReason::kNone;
  // The rest can be seen only from unreachable places, or by robots that are gone.
  const bool is_left =
      explorer.progress().unreachable > 0 || is_anything_left(absl::InfinitePast(), {});
  return is_left ? EndReason::kOnlyUnreachableLeft : EndReason::kDone;
}

}  // namespace hypermap::server
