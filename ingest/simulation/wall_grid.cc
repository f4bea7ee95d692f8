#include "ingest/simulation/wall_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hypermap::simulation {
namespace {

// How a ray goes through the columns, or the rows, of a grid.
struct Axis {
  // `begin` and `step` in cells, the latter for each t.
  Axis(double begin, double step)
      : cell(static_cast<int32_t>(std::floor(begin))),
        turn(step > 0 ? 1 : -1),
        each(step == 0 ? std::numeric_limits<double>::infinity() : 1.0 / std::abs(step)),
        next(step == 0 ? each : ((step > 0 ? cell + 1 - begin : begin - cell) * each)) {}

  void Advance() {
    cell += turn;
    next += each;
  }

  int32_t cell;
  int32_t turn;
  double each;  // t from one border to the next
  double next;  // t of the next border
};

}  // namespace

WallGrid::WallGrid(FloorPlan plan, const GridGeometry& geometry, double height_m)
    : plan_(std::move(plan)),
      geometry_(geometry),
      grid_from_world_(geometry.layer_from_grid.Inverse()),
      height_m_(height_m) {}

std::optional<double> WallGrid::Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double most) const {
  const double turn = grid_from_world_.yaw();
  const Point begin = grid_from_world_ * Point{origin.x(), origin.y()};
  const double r = geometry_.resolution_m;
  const double dx = std::cos(turn) * direction.x() - std::sin(turn) * direction.y();
  const double dy = std::sin(turn) * direction.x() + std::cos(turn) * direction.y();
  Axis cols(begin.x / r, dx / r), rows(begin.y / r, dy / r);
  const double to_floor =
      direction.z() < 0 ? -origin.z() / direction.z() : std::numeric_limits<double>::infinity();
  const double end = std::min(most, to_floor);
  bool inside = true;  // of the block that it begins in
  for (double t = 0; t <= end;) {
    const CellIndex cell{rows.cell, cols.cell};
    const double leave = std::min(rows.next, cols.next);
    const bool is_block = plan_.Contains(cell) && plan_.at(cell) != Floor::kFree;
    inside = inside && is_block;
    if (is_block && !inside) {
      const double z = origin.z() + t * direction.z();
      if (z >= 0 && z <= height_m_) return t;
      // Onto its top, from above.
      const double to_top = direction.z() < 0 ? (height_m_ - origin.z()) / direction.z() : -1.0;
      if (z > height_m_ && to_top >= t && to_top <= std::min(leave, end)) return to_top;
    }
    if (!is_block && leave >= end) break;
    t = leave;
    (rows.next < cols.next ? rows : cols).Advance();
  }
  if (to_floor > most || to_floor <= 0) return std::nullopt;
  const Point floor{begin.x + to_floor * dx, begin.y + to_floor * dy};
  const CellIndex cell{static_cast<int32_t>(std::floor(floor.y / r)),
                       static_cast<int32_t>(std::floor(floor.x / r))};
  if (!plan_.Contains(cell)) return std::nullopt;
  return to_floor;
}

}  // namespace hypermap::simulation
