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

  // A side of a block: part of the border between two columns, or between two rows.
  struct Side {
    bool is_between_columns = false;
    int32_t border = 0;  // The number of the column or row above the border.
    int32_t along = 0;   // The block's row, or its column.
  };
  // Returns the side at which origin + t * direction meets its first block, at whatever height, for
  // t in (0, most]; nullopt if it meets none.
  // REQUIRES: `origin` is not in a block.
  std::optional<Side> FirstSide(const Point& origin, const Point& direction, double most) const;
  // The line of a side: the points p with normal * (p - origin) = distance, in the world.
  struct Line {
    Point normal;
    double distance = 0.0;
  };
  Line LineOf(const Side& side, const Point& origin) const;
  // Returns the t in (0, most] at which the ray meets the floor from above, as if there were no
  // blocks; nullopt if it does not.
  std::optional<double> HitFloor(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                 double most) const;

  bool IsBlock(const Point& place) const;
  double height_m() const { return height_m_; }

 private:
  // Return a place or a direction of the world in cells of the plan.
  Point PlaceInCells(const Point& place) const;
  Point InCells(const Point& direction) const;
  CellIndex CellAt(const Point& place) const;

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
