#include "map/exploration/exploration_view.h"

namespace hypermap {

double ExplorationProgress::fraction() const {
  const int64_t all = cells.explored + cells.reachable;
  return all == 0 ? 1.0 : static_cast<double>(cells.explored) / static_cast<double>(all);
}

LeasedGoal ViewOf(const ExplorationGoal& goal, const PlanarTransform& frame_from_layer) {
  return {goal.id,         goal.robot,         frame_from_layer * Centroid(goal.cell),
          goal.gain_cells, goal.path_length_m, goal.expires_at.value_or(absl::UnixEpoch())};
}

GivenUpPlace ViewOf(const UnreachablePlace& place, const PlanarTransform& frame_from_layer) {
  return {place.id, place.robot, frame_from_layer * Centroid(place.cell)};
}

ExplorationEntry ViewOf(const ExplorationObjects& objects,
                        const PlanarTransform& frame_from_layer) {
  ExplorationEntry entry{objects.exploration, {}, {}};
  entry.exploration.area = frame_from_layer * entry.exploration.area;
  for (const ExplorationGoal& goal : objects.goals) {
    entry.goals.push_back(ViewOf(goal, frame_from_layer));
  }
  for (const UnreachablePlace& place : objects.unreachable_places) {
    entry.unreachable_places.push_back(ViewOf(place, frame_from_layer));
  }
  return entry;
}

FrontierEntry ViewOf(const Explorer::FrontierView& frontier, const GridGeometry& geometry,
                     const PlanarTransform& frame_from_floor, bool with_cells) {
  FrontierEntry entry;
  entry.num_cells = static_cast<int64_t>(frontier.cells.size());
  Point sum;
  for (const CellIndex& cell : frontier.cells) {
    const Point centre = frame_from_floor * geometry.CentreOf(cell);
    sum = {sum.x + centre.x, sum.y + centre.y};
    if (with_cells) entry.cells.push_back(centre);
  }
  const auto count = static_cast<double>(frontier.cells.size());
  entry.centroid = {sum.x / count, sum.y / count};
  if (!frontier.viewpoint) return entry;
  entry.viewpoint = frame_from_floor * geometry.CentreOf(frontier.viewpoint->cell);
  entry.gain_cells = frontier.viewpoint->gain_cells;
  return entry;
}

}  // namespace hypermap
