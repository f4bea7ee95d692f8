// Walls as an occupancy grid has them.
#ifndef HYPERMAP_SIMULATION_WORLDS_WALL_GRID_H_
#define HYPERMAP_SIMULATION_WORLDS_WALL_GRID_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "map/exploration/floor_plan.h"
#include "map/frames/planar_transform.h"

namespace hypermap::simulation {

// Each cell of the plan that is not free stands up from the floor as a block. There is floor in
// the plan's box, and nothing out of it.
class WallGrid {
 public:
  // `geometry` places the plan's cells in the world.
  WallGrid(FloorPlan plan, const GridGeometry& geometry, double height_m);

  const FloorPlan& plan() const { return plan_; }
  const GridGeometry& geometry() const { return geometry_; }

  // The least t in (0, most] at which origin + t * direction meets a block or the floor from above;
  // nullopt when it meets none. Nothing stands in the way of what begins inside a block until it
  // has left that (Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing",
  // Eurographics 1987).
  std::optional<double> Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            double most) const;

 private:
  FloorPlan plan_;
  CellRaster<uint8_t> away_;  // from the nearest block, in cells
  GridGeometry geometry_;
  PlanarTransform grid_from_world_;
  double cos_yaw_;
  double sin_yaw_;
  double height_m_;
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_WALL_GRID_H_
