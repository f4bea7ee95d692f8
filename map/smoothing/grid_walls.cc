#include "map/smoothing/grid_walls.h"

#include <cmath>

#include "map/smoothing/planar_pose.h"

namespace hypermap::smoothing {
namespace {

// A surface that is farther from every wall is furniture that the grid doesn't have.
constexpr double kReach_m = 0.5;
constexpr double kFarthestWall_m = 0.4;
// Near the middle between two walls the distance has no clear direction.
constexpr double kLeastGradient = 0.2;
// A wall faces the same way within 45 degrees.
constexpr double kMinWallCosine = 0.7;

}  // namespace

GridWalls::GridWalls(const GridLayer& grid, const PlanarTransform& grid_from_frame)
    : distance_(
          grid.geometry(), grid.extent(),
          [&](const CellIndex& cell) {
            const auto value = grid.ValueAt(cell);
            return value && *value > grid.spec().thresholds.occupied_above;
          },
          kReach_m),
      grid_from_frame_(grid_from_frame) {}

int64_t GridWalls::BytesFor(const GridLayer& grid) {
  const CellBox& box = grid.extent();
  const auto reach = static_cast<int64_t>(std::ceil(kReach_m / grid.geometry().resolution_m));
  return int64_t{sizeof(float)} * (box.row_end - box.row_begin + 2 * reach) *
         (box.col_end - box.col_begin + 2 * reach);
}

std::optional<GridWalls::Sample> GridWalls::At(const Eigen::Vector2d& place,
                                               const Eigen::Vector2d& normal) const {
  if (distance_.empty()) return std::nullopt;
  const Point in_grid = grid_from_frame_ * Point{place.x(), place.y()};
  const DistanceField::Sample sample = distance_.At({in_grid.x, in_grid.y});
  if (sample.distance_m > kFarthestWall_m) return std::nullopt;
  const Eigen::Vector2d gradient = Turn(grid_from_frame_.yaw()).Inverse(sample.gradient);
  const double steepness = gradient.norm();
  if (steepness < kLeastGradient) return std::nullopt;
  const double cosine = gradient.dot(normal) / steepness;
  if (std::abs(cosine) < kMinWallCosine) return std::nullopt;
  const double side = cosine > 0.0 ? 1.0 : -1.0;
  return Sample{side * sample.distance_m, side * gradient};
}

}  // namespace hypermap::smoothing
