// What of a site can be seen through and driven on.
#ifndef HYPERMAP_MAP_EXPLORATION_FLOOR_PLAN_H_
#define HYPERMAP_MAP_EXPLORATION_FLOOR_PLAN_H_

#include <cstdint>
#include <vector>

#include "map/exploration/cell_raster.h"
#include "map/layers/grid_layer.h"

namespace hypermap {

// Of a cell of an occupancy grid, by the thresholds of its layer. What is neither free nor occupied
// there is unknown.
enum class Floor : uint8_t { kUnknown, kFree, kOccupied };

// Out of its box all is unknown.
using FloorPlan = CellRaster<Floor>;

// The cells of `box` as `grid`, of an occupancy layer, has them.
FloorPlan ReadFloorPlan(const GridLayer& grid, const CellBox& box);

// A cell that is not as it was.
struct FloorChange {
  CellIndex cell;
  Floor before = Floor::kUnknown;
};

// Reads the cells of `part` anew.
std::vector<FloorChange> UpdateFloorPlan(const GridLayer& grid, const CellBox& part,
                                         FloorPlan* plan);

// Where a round robot can stand: its centre in a cell that no cell which is not free has its centre
// nearer to than the robot's radius. Follows a floor plan cell by cell: for each cell it counts
// what stands in the way, so that a change costs the cells of a disc. What lies out of the plan's
// box is in nobody's way.
class Clearance {
 public:
  // `radius_m` >= 0. The cell itself always has to be free.
  Clearance(const FloorPlan& plan, double radius_m, double resolution_m);

  bool IsClear(const CellIndex& cell) const {
    return in_the_way_.Contains(cell) && in_the_way_.at(cell) == 0;
  }
  // `cell` of the plan became free, or stopped being so.
  void SetFree(const CellIndex& cell, bool free);

 private:
  void CountAll(const FloorPlan& plan);

  // Half the width of the disc in cells, by row from its centre: row r spans -half[|r|]..half[|r|].
  std::vector<int32_t> half_widths_;
  CellRaster<int32_t> in_the_way_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_FLOOR_PLAN_H_
