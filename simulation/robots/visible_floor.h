// What of the floor robots could have seen, counted without the server.
#ifndef HYPERMAP_SIMULATION_ROBOTS_VISIBLE_FLOOR_H_
#define HYPERMAP_SIMULATION_ROBOTS_VISIBLE_FLOOR_H_

#include <cstdint>
#include <vector>

#include "map/layers/grid_layer.h"
#include "simulation/robots/terrain.h"

namespace hypermap::robots {

// Cells of the occupancy layer.
struct VisibleFloor {
  int64_t explored = 0;
  // Not explored, but in sight and in range of a place that robots can reach.
  int64_t missed = 0;
  // Not explored, and in sight from nowhere.
  int64_t hidden = 0;

  // Of what can be seen; 1 when that is nothing.
  double fraction() const {
    const int64_t visible = explored + missed;
    return visible == 0 ? 1.0 : static_cast<double>(explored) / static_cast<double>(visible);
  }
};

// A cell is explored when `explored` (an exploration layer, in the frame of the terrain; null: no
// cell is) says so at its centre. Robots reach what hangs together with a cell of `starts`.
VisibleFloor CountVisibleFloor(const Terrain& terrain, const GridLayer* explored,
                               const std::vector<CellIndex>& starts, double range_m);

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_VISIBLE_FLOOR_H_
