#include "map/exploration/floor_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "absl/functional/function_ref.h"
#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Calls visit(cell, floor) for each cell of `box` that is in a tile, tile by tile.
void VisitFloor(const GridLayer& grid, const CellBox& box,
                absl::FunctionRef<void(const CellIndex&, Floor)> visit) {
  const CodePredicate is_free = *grid.domain().Match(ValueKeyword::kFree);
  const CodePredicate is_occupied = *grid.domain().Match(ValueKeyword::kOccupied);
  const auto floor_of = [&](CellCode code) {
    if (IsUnknown(code)) return Floor::kUnknown;
    if (is_free(code)) return Floor::kFree;
    return is_occupied(code) ? Floor::kOccupied : Floor::kUnknown;
  };
  const CellBox within = box.Intersection(grid.extent());
  const auto visit_tile = [&](const TileIndex& index, const Tile& tile) {
    const CellBox cells = CellsOf(index);
    const CellBox part = within.Intersection(cells);
    for (int32_t row = part.row_begin; row < part.row_end; ++row) {
      for (int32_t col = part.col_begin; col < part.col_end; ++col) {
        visit({row, col}, floor_of(tile.at(row - cells.row_begin, col - cells.col_begin)));
      }
    }
  };
  if (within.empty()) return;
  const TileIndex first = TileOf({within.row_begin, within.col_begin});
  const TileIndex last = TileOf({within.row_end - 1, within.col_end - 1});
  for (int32_t row = first.row; row <= last.row; ++row) {
    const auto end = grid.tiles().upper_bound({row, last.col});
    for (auto it = grid.tiles().lower_bound({row, first.col}); it != end; ++it) {
      if (IsCancelled()) return;
      visit_tile(it->first, *it->second);
    }
  }
}

// Calls visit(cell, floor) for each cell of `part` whose state in `grid` is not that in `plan`.
void VisitChanges(const GridLayer& grid, const CellBox& part, const FloorPlan& plan,
                  absl::FunctionRef<void(const CellIndex&, Floor)> visit) {
  const FloorPlan now = ReadFloorPlan(grid, part.Intersection(plan.box()));
  const std::vector<Floor>& floors = now.values();
  for (size_t i = 0; i < floors.size(); ++i) {
    if (i % kCellsPerLook == 0 && IsCancelled()) return;
    const CellIndex cell = now.CellOf(i);
    if (plan.at(cell) != floors[i]) visit(cell, floors[i]);
  }
}

}  // namespace

FloorPlan ReadFloorPlan(const GridLayer& grid, const CellBox& box) {
  FloorPlan plan(box, Floor::kUnknown);
  VisitFloor(grid, box, [&plan](const CellIndex& cell, Floor floor) { plan.set(cell, floor); });
  return plan;
}

std::vector<FloorChange> UpdateFloorPlan(const GridLayer& grid, const CellBox& part,
                                         FloorPlan* plan) {
  std::vector<FloorChange> changed;
  VisitChanges(grid, part, *plan, [&](const CellIndex& cell, Floor floor) {
    changed.push_back({cell, plan->at(cell)});
    plan->set(cell, floor);
  });
  return changed;
}

int64_t CountFloorChanges(const GridLayer& grid, const CellBox& part, const FloorPlan& plan) {
  int64_t changes = 0;
  VisitChanges(grid, part, plan, [&changes](const CellIndex&, Floor) { ++changes; });
  return changes;
}

Clearance::Clearance(const FloorPlan& plan, double radius_m, double resolution_m)
    : in_the_way_(plan.box(), 0) {
  const double radius = std::max(radius_m, 0.0) / resolution_m;
  for (int32_t row = 0; row == 0 || row < radius; ++row) {
    const double half = std::sqrt(std::max(radius * radius - double{1.0} * row * row, 0.0));
    // Strictly less than the radius.
    half_widths_.push_back(std::max(0, static_cast<int32_t>(std::ceil(half)) - 1));
  }
  CountAll(plan);
}

// Uses prefix sums along rows, so that a cell costs one step for each row of the disc, rather than
// for each cell of it.
void Clearance::CountAll(const FloorPlan& plan) {
  const CellBox& box = plan.box();
  const auto reach = static_cast<int32_t>(half_widths_.size()) - 1;
  const auto cols = static_cast<int32_t>(box.cols());
  std::vector<int32_t> before(cols + 1, 0);  // Number of obstacles in the row, left of each column.
  for (int32_t row = box.row_begin; row < box.row_end && !IsCancelled(); ++row) {
    for (int32_t col = 0; col < cols; ++col) {
      before[col + 1] = before[col] + (plan.at({row, box.col_begin + col}) != Floor::kFree);
    }
    if (before[cols] == 0) continue;
    const int32_t row_end = std::min(row + reach + 1, box.row_end);
    for (int32_t to = std::max(row - reach, box.row_begin); to < row_end; ++to) {
      const int32_t half = half_widths_[std::abs(to - row)];
      int32_t* const counts =
          &in_the_way_.mutable_values()[in_the_way_.IndexOf({to, box.col_begin})];
      for (int32_t col = 0; col < cols; ++col) {
        counts[col] += before[std::min(col + half + 1, cols)] - before[std::max(col - half, 0)];
      }
    }
  }
}

void Clearance::SetFree(const CellIndex& obstacle, bool free) {
  const int32_t by = free ? -1 : 1;
  const auto reach = static_cast<int32_t>(half_widths_.size()) - 1;
  const CellBox& box = in_the_way_.box();
  const int32_t row_end = std::min(obstacle.row + reach + 1, box.row_end);
  for (int32_t row = std::max(obstacle.row - reach, box.row_begin); row < row_end; ++row) {
    const int32_t half = half_widths_[std::abs(row - obstacle.row)];
    const int32_t begin = std::max(obstacle.col - half, box.col_begin);
    const int32_t end = std::min(obstacle.col + half + 1, box.col_end);
    int32_t* const counts = &in_the_way_.mutable_values()[in_the_way_.IndexOf({row, begin})];
    for (int32_t i = 0; i < end - begin; ++i) counts[i] += by;
  }
}

int64_t Clearance::disc_cells() const {
  const auto cells_of_row = [](int32_t half) { return 2 * int64_t{half} + 1; };
  int64_t cells = -cells_of_row(half_widths_.front());  // There is only one middle row.
  for (const int32_t half : half_widths_) cells += 2 * cells_of_row(half);
  return cells;
}

}  // namespace hypermap
