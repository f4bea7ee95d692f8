// The floor plan that robots plan their paths on.
#ifndef HYPERMAP_SIMULATION_ROBOTS_TERRAIN_H_
#define HYPERMAP_SIMULATION_ROBOTS_TERRAIN_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "map/exploration/floor_plan.h"
#include "map/geometry/polygon.h"
#include "map/layers/grid_layer.h"

namespace hypermap::robots {

// An occupancy layer, and the area of it to be explored. Positions are in the layer's frame.
// Immutable; safe to use from many threads.
class Terrain {
 public:
  Terrain(const GridLayer& occupancy, const Polygon& area, double robot_radius_m);

  const GridGeometry& geometry() const { return geometry_; }
  // The whole layer, with a border of unknown cells.
  const FloorPlan& plan() const { return plan_; }
  // Returns whether the cell is free and its centre is in the area.
  bool IsFloor(const CellIndex& cell) const { return is_floor_.at(cell) != 0; }
  // Returns whether the centre of a robot may be in the cell: it is floor, and all cells that are
  // not free are at least the robot's radius away.
  bool IsPassable(const CellIndex& cell) const { return passable_.at(cell) == Floor::kFree; }
  // A plan in which only passable cells are free. Robots can drive along its lines of sight.
  const FloorPlan& passable() const { return passable_; }

  // Returns the shortest path for a robot, both ends included, in steps to the eight neighbours. A
  // diagonal step requires that both cells beside it are passable. Empty if there is no path, or an
  // end is not passable. A* (Hart, Nilsson and Raphael 1968) with the octile distance.
  std::vector<CellIndex> ShortestPath(const CellIndex& from, const CellIndex& to) const;
  // Returns the passable cell nearest to `p`; nullopt if there is none within `most_m`.
  std::optional<CellIndex> NearestPassable(const Point& p, double most_m) const;
  // Returns all cells that can be reached from `cell`, which is included.
  std::vector<CellIndex> ReachableFrom(const CellIndex& cell) const;
  // Returns the largest set of cells that can be reached from each other, ascending.
  std::vector<CellIndex> LargestRegion() const;

 private:
  GridGeometry geometry_;
  FloorPlan plan_;
  CellRaster<uint8_t> is_floor_;
  FloorPlan passable_;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_TERRAIN_H_
