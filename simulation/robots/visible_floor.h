// Counts the floor that robots could see, independently of the server.
#ifndef HYPERMAP_SIMULATION_ROBOTS_VISIBLE_FLOOR_H_
#define HYPERMAP_SIMULATION_ROBOTS_VISIBLE_FLOOR_H_

#include <cstdint>
#include <vector>

#include "map/layers/grid_layer.h"
#include "simulation/robots/terrain.h"

namespace hypermap::robots {

// Numbers of cells of the occupancy layer.
struct VisibleFloor {
  int64_t explored = 0;
  // Cells that are not explored, but visible within range from a place that robots can reach.
  int64_t missed = 0;
  // Cells that are neither explored nor visible from such a place.
  int64_t hidden = 0;

  // Returns the explored share of the explored and missed cells; 1 if there are none.
  double fraction() const {
    const int64_t visible = explored + missed;
    return visible == 0 ? 1.0 : static_cast<double>(explored) / static_cast<double>(visible);
  }
};

// Counts the cells of the terrain's floor. `explored` is an exploration layer in the frame of the
// terrain, looked up at the cells' centres; if it is null, no cell is explored. Robots can reach
// all passable cells that are connected to a cell of `starts`.
VisibleFloor CountVisibleFloor(const Terrain& terrain, const GridLayer* explored,
                               const std::vector<CellIndex>& starts, double range_m);

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_VISIBLE_FLOOR_H_
