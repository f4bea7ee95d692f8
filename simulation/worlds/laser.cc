#include "simulation/worlds/laser.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hypermap::simulation {
namespace {

constexpr double kLaserHeight_m = 0.2;
constexpr double kNearest_m = 1e-6;
// Number of times that the angle between two bearings is halved where the range jumps.
constexpr int kHalvings = 4;

class Scan {
 public:
  Scan(const WallGrid& walls, const Point& foot, double range_m)
      : walls_(walls), foot_(foot), range_m_(range_m) {}

  double RangeAt(double bearing) const {
    const Eigen::Vector3d ahead(std::cos(bearing), std::sin(bearing), 0.0);
    const auto hit = walls_.Hit({foot_.x, foot_.y, kLaserHeight_m}, ahead, range_m_);
    return std::max(kNearest_m, hit.value_or(range_m_));
  }
  Point At(double bearing, double range_m) const {
    return {foot_.x + range_m * std::cos(bearing), foot_.y + range_m * std::sin(bearing)};
  }
  // Adds the points between two bearings, by bisection, while their ranges r0 and r1 differ by a
  // cell or more.
  void AddBetween(double b0, double r0, double b1, double r1, int halvings, Ring* ring) const {
    if (halvings == 0 || std::abs(r0 - r1) < walls_.geometry().resolution_m) return;
    const double middle = 0.5 * (b0 + b1);
    const double range = RangeAt(middle);
    AddBetween(b0, r0, middle, range, halvings - 1, ring);
    ring->push_back(At(middle, range));
    AddBetween(middle, range, b1, r1, halvings - 1, ring);
  }

 private:
  const WallGrid& walls_;
  const Point foot_;
  const double range_m_;
};

}  // namespace

Polygon FreeBefore(const WallGrid& walls, const PlanarTransform& world_from_laser,
                   const LaserFan& fan) {
  const Point foot{world_from_laser.x(), world_from_laser.y()};
  const std::optional<CellIndex> cell = walls.geometry().CellAt(foot);
  if (!cell || walls.plan().at(*cell) != Floor::kFree) return {};
  const double apart = walls.geometry().resolution_m / (3.0 * fan.range_m);
  const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * fan.half_width_rad / apart)));
  const Scan scan(walls, foot, fan.range_m);
  Ring ring{foot};
  double before = 0.0, range_before = 0.0;
  for (int i = 0; i <= steps; ++i) {
    const double bearing =
        world_from_laser.yaw() + fan.half_width_rad * (2.0 * static_cast<double>(i) / steps - 1.0);
    const double range = scan.RangeAt(bearing);
    if (i > 0) scan.AddBetween(before, range_before, bearing, range, kHalvings, &ring);
    ring.push_back(scan.At(bearing, range));
    before = bearing;
    range_before = range;
  }
  absl::StatusOr<Polygon> free = Polygon::Make(std::move(ring));
  return free.ok() ? *std::move(free) : Polygon();
}

}  // namespace hypermap::simulation
