// The walls of an occupancy grid, to which upright surfaces are compared.
#ifndef HYPERMAP_MAP_SMOOTHING_GRID_WALLS_H_
#define HYPERMAP_MAP_SMOOTHING_GRID_WALLS_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "map/frames/planar_transform.h"
#include "map/grid/distance_field.h"
#include "map/layers/grid_layer.h"

namespace hypermap::smoothing {

// Immutable; safe to use from many threads.
class GridWalls {
 public:
  // Copies the occupied cells. `grid_from_frame` transforms from the frame of the poses to that of
  // the layer. Linear in the cells of the layer's extent.
  GridWalls(const GridLayer& grid, const PlanarTransform& grid_from_frame);

  // Memory of the walls of a grid.
  static int64_t BytesFor(const GridLayer& grid);

  struct Sample {
    // Distance of the place in front of the wall's cells, metres; negative behind them.
    double distance_m = 0.0;
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };
  // Compares the place of an upright surface whose normal (of length 1) points to where it was seen
  // from. nullopt if there is no wall near that faces the same way.
  std::optional<Sample> At(const Eigen::Vector2d& place, const Eigen::Vector2d& normal) const;

 private:
  DistanceField distance_;
  PlanarTransform grid_from_frame_;
};

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_GRID_WALLS_H_
