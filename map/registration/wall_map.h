// An occupancy grid, prepared for being matched with another.
#ifndef HYPERMAP_MAP_REGISTRATION_WALL_MAP_H_
#define HYPERMAP_MAP_REGISTRATION_WALL_MAP_H_

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "map/exploration/floor_plan.h"
#include "map/geometry/point.h"
#include "map/grid/distance_field.h"
#include "map/layers/grid_layer.h"

namespace hypermap::registration {

// The walls of a grid, and what it knows of the places between them. All coordinates are in the
// layer's frame. Immutable; safe to use from many threads.
class WallMap {
 public:
  // Cells of the smallest box around all known cells (205 m x 205 m with cells of 5 cm), and
  // occupied ones, and the bytes that a map takes for each of them.
  static constexpr int64_t kMaxCells = int64_t{1} << 24;
  static constexpr int64_t kMaxWalls = int64_t{1} << 21;
  static constexpr int64_t kBytesOfCell = 10;
  static constexpr int64_t kBytesOfWall = 16;
  // Largest side of a cell: walls are compared to within some cells, which must be less than the
  // reach.
  static constexpr double kMaxResolution_m = 0.5;
  // Distances to walls are known up to this.
  static constexpr double kReach_m = 1.5;

  // FAILED_PRECONDITION if no cell is occupied or cells are larger than kMaxResolution_m,
  // RESOURCE_EXHAUSTED for more than kMaxCells or kMaxWalls, and errors of CheckCancelled and
  // TakeMemory. Linear in the cells. `grid` is an occupancy layer, which errors call `name`.
  static absl::StatusOr<WallMap> Make(const GridLayer& grid, absl::string_view name);

  // The centres of the occupied cells.
  const std::vector<Eigen::Vector2d>& walls() const { return walls_; }
  // The mean of the walls, and their root mean square distance from it.
  const Eigen::Vector2d& centre() const { return centre_; }
  double spread_m() const { return spread_m_; }
  // The greatest distance of a wall from the mean.
  double radius_m() const { return radius_m_; }
  Box bounds() const { return bounds_; }
  double resolution_m() const { return geometry_.resolution_m; }
  // The length of all walls if they are as thin as a cell.
  double length_m() const { return static_cast<double>(walls_.size()) * geometry_.resolution_m; }

  // Distances to the nearest wall.
  const DistanceField& distance() const { return distance_; }
  // What is known of the place.
  Floor FloorAt(const Eigen::Vector2d& place) const;
  bool IsFree(const Eigen::Vector2d& place) const { return FloorAt(place) == Floor::kFree; }

 private:
  WallMap(const GridGeometry& geometry, FloorPlan plan);

  void CollectWalls();
  // Sets what is told of the walls as a whole.
  void Measure();

  GridGeometry geometry_;
  FloorPlan plan_;
  DistanceField distance_;
  std::vector<Eigen::Vector2d> walls_;
  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
  double spread_m_ = 0.0;
  double radius_m_ = 0.0;
  Box bounds_;
};

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_WALL_MAP_H_
