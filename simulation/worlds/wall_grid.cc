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

// The cells that a ray traverses. There is no block within a cell's distance to the nearest one, so
// that as many columns and rows can be crossed at once.
class Traversal {
 public:
  // `begin` and `step` (per unit of t) are in cells.
  Traversal(const FloorPlan& plan, const CellRaster<uint8_t>& away, const Point& begin,
            const Point& step)
      : plan_(plan), away_(away), cols_(begin.x, step.x), rows_(begin.y, step.y) {
    Look();
  }

  CellIndex cell() const { return {rows_.cell, cols_.cell}; }
  bool is_block() const { return is_block_; }
  double t() const { return t_; }          // Where the ray enters the cell; 0 in the first one.
  double leave() const { return leave_; }  // Where it leaves it.
  // The border by which the ray has entered the cell. REQUIRES: it is not the first cell.
  WallGrid::Side side() const {
    const Axis& axis = by_column_ ? cols_ : rows_;
    return {by_column_, axis.turn > 0 ? axis.cell : axis.cell + 1,
            by_column_ ? rows_.cell : cols_.cell};
  }

  void Next() {
    t_ = leave_;
    by_column_ = rows_.After(clear_) >= cols_.After(clear_);
    Axis& first = by_column_ ? cols_ : rows_;
    Axis& second = by_column_ ? rows_ : cols_;
    first.Advance(clear_);
    second.AdvanceTo(t_, clear_ - 1);
    Look();
  }

 private:
  void Look() {
    const bool is_in_plan = plan_.Contains(cell());
    is_block_ = is_in_plan && plan_.at(cell()) != Floor::kFree;
    clear_ = is_in_plan ? std::max<int32_t>(1, away_.at(cell())) : 1;
    leave_ = std::min(rows_.After(clear_), cols_.After(clear_));
  }

  const FloorPlan& plan_;
  const CellRaster<uint8_t>& away_;
  Axis cols_;
  Axis rows_;
  double t_ = 0.0;
  double leave_ = 0.0;
  int32_t clear_ = 1;  // Borders to cross at once.
  bool is_block_ = false;
  bool by_column_ = false;
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

Point WallGrid::InCells(const Point& direction) const {
  const double r = geometry_.resolution_m;
  return {(cos_yaw_ * direction.x - sin_yaw_ * direction.y) / r,
          (sin_yaw_ * direction.x + cos_yaw_ * direction.y) / r};
}

std::optional<double> WallGrid::Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double most) const {
  const double to_floor =
      direction.z() < 0 ? -origin.z() / direction.z() : std::numeric_limits<double>::infinity();
  const double end = std::min(most, to_floor);
  bool inside = true;  // Whether the ray has not yet left the blocks in which it begins.
  for (Traversal way(plan_, away_, PlaceInCells({origin.x(), origin.y()}),
                     InCells({direction.x(), direction.y()}));
       way.t() <= end; way.Next()) {
    inside = inside && way.is_block();
    if (way.is_block() && !inside) {
      const double z = origin.z() + way.t() * direction.z();
      if (z >= 0 && z <= height_m_) return way.t();
      // The ray is above the block here, and may come down onto its top before it leaves the cell.
      const double to_top = direction.z() < 0 ? (height_m_ - origin.z()) / direction.z() : -1.0;
      if (z > height_m_ && to_top >= way.t() && to_top <= std::min(way.leave(), end)) return to_top;
    }
    if (!way.is_block() && way.leave() >= end) break;
  }
  return HitFloor(origin, direction, most);
}

std::optional<WallGrid::Side> WallGrid::FirstSide(const Point& origin, const Point& direction,
                                                  double most) const {
  Traversal way(plan_, away_, PlaceInCells(origin), InCells(direction));
  while (!way.is_block()) {
    if (way.leave() > most) return std::nullopt;
    way.Next();
  }
  return way.side();
}

WallGrid::Line WallGrid::LineOf(const Side& side, const Point& origin) const {
  const Point begin = PlaceInCells(origin);
  if (side.is_between_columns) {
    return {{cos_yaw_, -sin_yaw_}, (side.border - begin.x) * geometry_.resolution_m};
  }
  return {{sin_yaw_, cos_yaw_}, (side.border - begin.y) * geometry_.resolution_m};
}

std::optional<double> WallGrid::HitFloor(const Eigen::Vector3d& origin,
                                         const Eigen::Vector3d& direction, double most) const {
  if (direction.z() >= 0) return std::nullopt;
  const double t = -origin.z() / direction.z();
  if (t > most || t <= 0) return std::nullopt;
  const Point floor{origin.x() + t * direction.x(), origin.y() + t * direction.y()};
  if (!plan_.Contains(CellAt(floor))) return std::nullopt;
  return t;
}

bool WallGrid::IsBlock(const Point& place) const {
  const CellIndex cell = CellAt(place);
  return plan_.Contains(cell) && plan_.at(cell) != Floor::kFree;
}

Point WallGrid::PlaceInCells(const Point& place) const {
  const Point in_grid = grid_from_world_ * place;
  return {in_grid.x / geometry_.resolution_m, in_grid.y / geometry_.resolution_m};
}

CellIndex WallGrid::CellAt(const Point& place) const {
  const Point in_cells = PlaceInCells(place);
  return {static_cast<int32_t>(std::floor(in_cells.y)),
          static_cast<int32_t>(std::floor(in_cells.x))};
}

}  // namespace hypermap::simulation
