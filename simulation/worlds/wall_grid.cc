#include "simulation/worlds/wall_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hypermap::simulation {
namespace {

// Parameter of borders that a ray never crosses. Finite, so that sums of it remain comparable.
constexpr double kNever = 1e30;

// The traversal of a grid's columns, or of its rows, by a ray.
struct Axis {
  // The ray begins at coordinate `begin` and moves by `step` per unit of t, both in cells.
  Axis(double begin, double step)
      : cell(static_cast<int32_t>(std::floor(begin))),
        turn(step > 0 ? 1 : -1),
        each(step == 0 ? kNever : 1.0 / std::abs(step)),
        next(step == 0 ? each : ((step > 0 ? cell + 1 - begin : begin - cell) * each)) {}

  // Moves over `cells` borders.
  void Advance(int32_t cells) {
    cell += turn * cells;
    next += cells * each;
  }
  // Returns the t at which the ray crosses the border number `cells`, counted from 1.
  double After(int32_t cells) const { return next + (cells - 1) * each; }
  // Moves over all borders before `t`, but at most over `most`.
  void AdvanceTo(double t, int32_t most) {
    if (next >= t) return;
    Advance(std::min(most, static_cast<int32_t>((t - next) / each) + 1));
  }

  int32_t cell;
  int32_t turn;
  double each;  // Difference of t between two borders.
  double next;  // t of the next border.
};

// Chessboard distance of each cell to the nearest cell that is not free, at most kFarthest, in two
// passes (Rosenfeld and Pfaltz 1966).
constexpr uint8_t kFarthest = 100;

CellRaster<uint8_t> DistancesToBlocks(const FloorPlan& plan) {
  CellRaster<uint8_t> away(plan.box(), kFarthest);
  const auto pass = [&](const CellIndex& cell, int32_t back) {
    uint8_t least = away.at(cell);
    for (const CellIndex& next : {CellIndex{cell.row, cell.col + back},
                                  {cell.row + back, cell.col - 1},
                                  {cell.row + back, cell.col},
                                  {cell.row + back, cell.col + 1}}) {
      least = std::min<uint8_t>(least, std::min<uint8_t>(away.at(next), kFarthest - 1) + 1);
    }
    away.set(cell, plan.at(cell) == Floor::kFree ? least : 0);
  };
  const size_t size = plan.values().size();
  for (size_t i = 0; i < size; ++i) pass(plan.CellOf(i), -1);
  for (size_t i = size; i-- > 0;) pass(plan.CellOf(i), 1);
  return away;
}

}  // namespace

WallGrid::WallGrid(FloorPlan plan, const GridGeometry& geometry, double height_m)
    : plan_(std::move(plan)),
      away_(DistancesToBlocks(plan_)),
      geometry_(geometry),
      grid_from_world_(geometry.layer_from_grid.Inverse()),
      cos_yaw_(std::cos(grid_from_world_.yaw())),
      sin_yaw_(std::sin(grid_from_world_.yaw())),
      height_m_(height_m) {}

std::optional<double> WallGrid::Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double most) const {
  const Point begin = grid_from_world_ * Point{origin.x(), origin.y()};
  const double r = geometry_.resolution_m;
  const double dx = cos_yaw_ * direction.x() - sin_yaw_ * direction.y();
  const double dy = sin_yaw_ * direction.x() + cos_yaw_ * direction.y();
  Axis cols(begin.x / r, dx / r), rows(begin.y / r, dy / r);
  const double to_floor =
      direction.z() < 0 ? -origin.z() / direction.z() : std::numeric_limits<double>::infinity();
  const double end = std::min(most, to_floor);
  bool inside = true;  // Whether the ray has not yet left the blocks in which it begins.
  for (double t = 0; t <= end;) {
    const CellIndex cell{rows.cell, cols.cell};
    // There is no block within the distance to the nearest one, so that as many columns and rows
    // can be crossed at once.
    const bool is_in_plan = plan_.Contains(cell);
    const int32_t clear = is_in_plan ? std::max<int32_t>(1, away_.at(cell)) : 1;
    const double leave = std::min(rows.After(clear), cols.After(clear));
    const bool is_block = is_in_plan && plan_.at(cell) != Floor::kFree;
    inside = inside && is_block;
    if (is_block && !inside) {
      const double z = origin.z() + t * direction.z();
      if (z >= 0 && z <= height_m_) return t;
      // The ray is above the block here, and may come down onto its top before it leaves the cell.
      const double to_top = direction.z() < 0 ? (height_m_ - origin.z()) / direction.z() : -1.0;
      if (z > height_m_ && to_top >= t && to_top <= std::min(leave, end)) return to_top;
    }
    if (!is_block && leave >= end) break;
    t = leave;
    Axis& first = rows.After(clear) < cols.After(clear) ? rows : cols;
    Axis& second = &first == &rows ? cols : rows;
    first.Advance(clear);
    second.AdvanceTo(t, clear - 1);
  }
  if (to_floor > most || to_floor <= 0) return std::nullopt;
  const Point floor{begin.x + to_floor * dx, begin.y + to_floor * dy};
  const CellIndex cell{static_cast<int32_t>(std::floor(floor.y / r)),
                       static_cast<int32_t>(std::floor(floor.x / r))};
  if (!plan_.Contains(cell)) return std::nullopt;
  return to_floor;
}

}  // namespace hypermap::simulation
