#include "simulation/worlds/wall_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hypermap::simulation {
namespace {

// Later than a ray ends; finite, so that sums of it are ordered.
constexpr double kNever = 1e30;

// How a ray goes through the columns, or the rows, of a grid.
struct Axis {
  // `begin` and `step` in cells, the latter for each t.
  Axis(double begin, double step)
      : cell(static_cast<int32_t>(std::floor(begin))),
        turn(step > 0 ? 1 : -1),
        each(step == 0 ? kNever : 1.0 / std::abs(step)),
        next(step == 0 ? each : ((step > 0 ? cell + 1 - begin : begin - cell) * each)) {}

  // Over `cells` borders.
  void Advance(int32_t cells) {
    cell += turn * cells;
    next += cells * each;
  }
  // When it has gone over so many borders.
  double After(int32_t cells) const { return next + (cells - 1) * each; }
  // Over all borders before `t`, at most `most`.
  void AdvanceTo(double t, int32_t most) {
    if (next >= t) return;
    Advance(std::min(most, static_cast<int32_t>((t - next) / each) + 1));
  }

  int32_t cell;
  int32_t turn;
  double each;  // t from one border to the next
  double next;  // t of the next border
};

// The distance to the nearest cell that is not free, in steps to the eight neighbours; what is far
// counts as kFarthest (Rosenfeld and Pfaltz 1966: two passes).
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
  bool inside = true;  // of the block that it begins in
  for (double t = 0; t <= end;) {
    const CellIndex cell{rows.cell, cols.cell};
    // As many cells at once as there can be no block in.
    const bool is_in_plan = plan_.Contains(cell);
    const int32_t clear = is_in_plan ? std::max<int32_t>(1, away_.at(cell)) : 1;
    const double leave = std::min(rows.After(clear), cols.After(clear));
    const bool is_block = is_in_plan && plan_.at(cell) != Floor::kFree;
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
