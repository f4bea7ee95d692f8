// The walls that a camera sees, found with one ray for each sector instead of one for each pixel.
#ifndef HYPERMAP_SIMULATION_WORLDS_WALL_FAN_H_
#define HYPERMAP_SIMULATION_WORLDS_WALL_FAN_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "map/geometry/polygon.h"
#include "simulation/worlds/wall_grid.h"

namespace hypermap::simulation {

// Horizontal directions ahead of a camera: slope is the component to the left for one unit forward.
struct FanView {
  Eigen::Vector3d origin;
  Point forward;            // Of length 1.
  double slope_low = 0.0;   // The rightmost direction,
  double slope_high = 0.0;  // and the leftmost one.
  double reach_m = 0.0;     // Distance that is looked at, along `forward`.
};

// Divides the view into sectors that are narrower than a cell, up to the reach. No block fits
// between the two rays at the borders of such a sector without touching one of them. So if both
// meet the same side of a wall first, or no wall, then all rays of the sector do. Rays of other
// sectors traverse the grid. `walls` must outlive the fan.
class WallFan {
 public:
  WallFan(const WallGrid& walls, const FanView& view);

  // Equals walls.Hit(view.origin, direction, most), up to rounding.
  std::optional<double> Hit(const Eigen::Vector3d& direction, double most) const;

 private:
  enum class See : uint8_t { kUnsure, kNothing, kSide };
  struct Sector {
    See sees = See::kUnsure;
    WallGrid::Line side;
  };

  const WallGrid& walls_;
  const FanView view_;
  const Point left_;
  double sectors_per_slope_ = 0.0;
  std::vector<Sector> sectors_;  // From the right to the left. Empty if all are unsure.
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_WALL_FAN_H_
