#include "simulation/robots/visible_floor.h"

#include <algorithm>
#include <cmath>

#include "map/exploration/viewshed.h"

namespace hypermap::robots {
namespace {

CellRaster<uint8_t> ReachableFrom(const Terrain& terrain, const std::vector<CellIndex>& starts) {
  CellRaster<uint8_t> reachable(terrain.plan().box(), 0);
  for (const CellIndex& start : starts) {
    if (reachable.at(start) != 0) continue;
    for (const CellIndex& cell : terrain.ReachableFrom(start)) reachable.set(cell, 1);
  }
  return reachable;
}

bool IsExplored(const GridLayer* explored, const Point& p) {
  if (explored == nullptr) return false;
  const std::optional<CellIndex> cell = explored->geometry().CellAt(p);
  return cell && explored->ValueAt(*cell).value_or(0.0) != 0.0;
}

}  // namespace

VisibleFloor CountVisibleFloor(const Terrain& terrain, const GridLayer* explored,
                               const std::vector<CellIndex>& starts, double range_m) {
  const CellRaster<uint8_t> reachable = ReachableFrom(terrain, starts);
  const double range = range_m / terrain.geometry().resolution_m;
  ViewshedRays rays(std::max(1, static_cast<int32_t>(std::lround(range))));
  VisibleFloor floor;
  for (size_t i = 0; i < terrain.plan().values().size(); ++i) {
    const CellIndex cell = terrain.plan().CellOf(i);
    if (!terrain.IsFloor(cell)) continue;
    if (IsExplored(explored, terrain.geometry().CentreOf(cell))) {
      ++floor.explored;
      continue;
    }
    // Visibility is taken to be symmetric: looking from the cell finds the places that see it.
    bool is_seen = false;
    rays.ForEachVisible(terrain.plan(), cell, [&](const CellIndex& place) {
      is_seen = is_seen || reachable.at(place) != 0;
    });
    ++(is_seen ? floor.missed : floor.hidden);
  }
  return floor;
}

}  // namespace hypermap::robots
