#include "simulation/worlds/wall_fan.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hypermap::simulation {
namespace {

// Sectors for the width of a cell at the farthest place. One would be enough; more of them meet the
// same side at both borders.
constexpr double kSectorsPerCell = 4.0;
// With more of them, for the cells of a very fine grid, the fan would cost as much as the pixels.
constexpr double kMostSectors = 20'000;

}  // namespace

WallFan::WallFan(const WallGrid& walls, const FanView& view)
    : walls_(walls), view_(view), left_{-view.forward.y, view.forward.x} {
  const Point origin{view.origin.x(), view.origin.y()};
  // From between the floor and the top of the blocks, a ray that passes below or above one of them
  // leaves that space for good, so that only its first block counts.
  if (view.origin.z() < 0.0 || view.origin.z() > walls.height_m() || walls.IsBlock(origin)) return;
  const double width = view.slope_high - view.slope_low;
  const double wanted =
      std::ceil(width * view.reach_m / walls.geometry().resolution_m * kSectorsPerCell);
  if (!(wanted > 0.0 && wanted <= kMostSectors)) return;
  const auto num_sectors = static_cast<size_t>(wanted);
  sectors_per_slope_ = static_cast<double>(num_sectors) / width;
  std::optional<WallGrid::Side> last;
  for (size_t i = 0; i <= num_sectors; ++i) {
    const double slope = view.slope_low + static_cast<double>(i) / sectors_per_slope_;
    const std::optional<WallGrid::Side> side = walls.FirstSide(
        origin, {view.forward.x + slope * left_.x, view.forward.y + slope * left_.y}, view.reach_m);
    if (i > 0) {
      Sector& sector = sectors_.emplace_back();
      if (!side && !last) {
        sector.sees = See::kNothing;
      } else if (side && last && side->is_between_columns == last->is_between_columns &&
                 side->border == last->border && std::abs(side->along - last->along) <= 1) {
        sector = {See::kSide, walls.LineOf(*side, origin)};
      }
    }
    last = side;
  }
}

std::optional<double> WallFan::Hit(const Eigen::Vector3d& direction, double most) const {
  const Point level{direction.x(), direction.y()};
  const double forward = level.x * view_.forward.x + level.y * view_.forward.y;
  const double at =
      ((level.x * left_.x + level.y * left_.y) / forward - view_.slope_low) * sectors_per_slope_;
  if (sectors_.empty() || forward <= 0.0 || most * forward > view_.reach_m || !(at >= 0.0) ||
      at >= static_cast<double>(sectors_.size())) {
    return walls_.Hit(view_.origin, direction, most);
  }
  const Sector& sector = sectors_[static_cast<size_t>(at)];
  if (sector.sees == See::kUnsure) return walls_.Hit(view_.origin, direction, most);
  if (sector.sees == See::kSide) {
    const Point& normal = sector.side.normal;
    const double t = sector.side.distance / (normal.x * level.x + normal.y * level.y);
    const double z = view_.origin.z() + t * direction.z();
    if (t <= most && z >= 0.0) return z <= walls_.height_m() ? std::optional(t) : std::nullopt;
  }
  return walls_.HitFloor(view_.origin, direction, most);
}

}  // namespace hypermap::simulation
