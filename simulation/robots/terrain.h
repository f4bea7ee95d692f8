// What robots know of a place before they have seen it.
#ifndef HYPERMAP_SIMULATION_ROBOTS_TERRAIN_H_
#define HYPERMAP_SIMULATION_ROBOTS_TERRAIN_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "map/exploration/floor_plan.h"
#include "map/geometry/polygon.h"
#include "map/layers/grid_layer.h"

namespace hypermap::robots {

// An occupancy layer, and the area of it that is to be explored. Positions are in the layer's
// frame. Immutable.
class Terrain {
 public:
  Terrain(const GridLayer& occupancy, const Polygon& area, double robot_radius_m);

  const GridGeometry& geometry() const { return geometry_; }
  // All of the layer, with a border that is unknown.
  const FloorPlan& plan() const { return plan_; }
  // Free, and its centre in the area.
  bool IsFloor(const CellIndex& cell) const { return is_floor_.at(cell) != 0; }
  // Where the middle of a robot may be: floor that is not too near to what is not free.
  bool IsPassable(const CellIndex& cell) const { return passable_.at(cell) == Floor::kFree; }
  // Free where robots may be: what lines of InSight may be driven along.
  const FloorPlan& passable() const { return passable_; }

  // The shortest way for a robot, both ends included, in steps to the eight neighbours, which go
  // past a corner only where both cells beside it can be crossed (A*: Hart, Nilsson and Raphael,
  // 1968, with the octile distance). Empty when there is none, or an end is not passable.
  std::vector<CellIndex> ShortestPath(const CellIndex& from, const CellIndex& to) const;
  // The passable cell nearest to `p`; nullopt when there is none within `most_m`.
  std::optional<CellIndex> NearestPassable(const Point& p, double most_m) const;
  // All that can be reached from `cell`, it included.
  std::vector<CellIndex> ReachableFrom(const CellIndex& cell) const;
  // The largest set of cells that can be reached from each other.
  std::vector<CellIndex> LargestRegion() const;

 private:
  GridGeometry geometry_;
  FloorPlan plan_;
  CellRaster<uint8_t> is_floor_;
  FloorPlan passable_;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_TERRAIN_H_
