// Ray casting against the walls of an occupancy grid.
#ifndef HYPERMAP_SIMULATION_WORLDS_WALL_GRID_H_
#define HYPERMAP_SIMULATION_WORLDS_WALL_GRID_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "map/exploration/floor_plan.h"
#include "map/frames/planar_transform.h"

namespace hypermap::simulation {

// Each cell of the plan that is not free is a block that stands on the floor. The floor covers the
// plan's box, and there is nothing outside. Immutable; safe to use from many threads.
class WallGrid {
 public:
  // `geometry` places the plan's cells in the world; the blocks are `height_m` high. Linear in the
  // number of cells.
  WallGrid(FloorPlan plan, const GridGeometry& geometry, double height_m);

  const FloorPlan& plan() const { return plan_; }
  const GridGeometry& geometry() const { return geometry_; }

  // Returns the least t in (0, most] at which origin + t * direction meets a block, or the floor
  // from above; nullopt if it meets none. A ray that begins inside blocks ignores them until it has
  // left them. Traverses the grid cell by cell (Amanatides and Woo, "A fast voxel traversal
  // algorithm for ray tracing", Eurographics 1987), and skips free cells by their distance to the
  // nearest block.
  std::optional<double> Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double most) const;

 private:
  FloorPlan plan_;
  CellRaster<uint8_t> away_;  // Chessboard distance to the nearest block, in cells.
  GridGeometry geometry_;
  PlanarTransform grid_from_world_;
  double cos_yaw_;
  double sin_yaw_;
  double height_m_;
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_WALL_GRID_H_
