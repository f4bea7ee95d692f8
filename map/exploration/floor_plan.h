// The floor plan of a site: where robots can drive, and what blocks their view.
#ifndef HYPERMAP_MAP_EXPLORATION_FLOOR_PLAN_H_
#define HYPERMAP_MAP_EXPLORATION_FLOOR_PLAN_H_

#include <cstdint>
#include <vector>

#include "map/exploration/cell_raster.h"
#include "map/layers/grid_layer.h"

namespace hypermap {

// The state of a cell of an occupancy grid, by the thresholds of its layer. Cells between the
// thresholds count as unknown.
enum class Floor : uint8_t { kUnknown, kFree, kOccupied };

// Cells outside its box are unknown.
using FloorPlan = CellRaster<Floor>;

// Returns the cells of `box` in `grid`, an occupancy layer.
FloorPlan ReadFloorPlan(const GridLayer& grid, const CellBox& box);

// A cell whose state changed.
struct FloorChange {
  CellIndex cell;
  Floor before = Floor::kUnknown;
};

// Reads the cells of `part` again, and returns those that changed. Costs as much as the cells of
// `part`, however large the grid is.
std::vector<FloorChange> UpdateFloorPlan(const GridLayer& grid, const CellBox& part,
                                         FloorPlan* plan);
// Returns the number of cells that UpdateFloorPlan would change.
int64_t CountFloorChanges(const GridLayer& grid, const CellBox& part, const FloorPlan& plan);

// The places where a round robot can stand: cells that are free, with no other cell that is not
// free nearer than the robot's radius (from centre to centre). Counts, for each cell, the obstacles
// within the radius, so that a change costs a disc of cells. Cells outside the plan's box are not
// obstacles.
class Clearance {
 public:
  // `radius_m` >= 0. With radius 0, only the cell itself must be free.
  Clearance(const FloorPlan& plan, double radius_m, double resolution_m);

  bool IsClear(const CellIndex& cell) const {
    return in_the_way_.Contains(cell) && in_the_way_.at(cell) == 0;
  }
  // Records that `cell` of the plan became free, or is no longer free. Updates disc_cells()
  // counters.
  void SetFree(const CellIndex& cell, bool free);

  // Cells and rows of the disc within the radius. The constructor takes disc_rows() steps for each
  // cell of the plan.
  int64_t disc_cells() const;
  int64_t disc_rows() const { return 2 * static_cast<int64_t>(half_widths_.size()) - 1; }

 private:
  void CountAll(const FloorPlan& plan);

  // Half the width of the disc in cells, by distance from its middle row: row r spans
  // -half[|r|]..half[|r|].
  std::vector<int32_t> half_widths_;
  CellRaster<int32_t> in_the_way_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_FLOOR_PLAN_H_
