#include "map/registration/wall_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"

namespace hypermap::registration {
namespace {

// Returns the smallest box around the known cells of a tile.
CellBox KnownCellsOf(const TileIndex& index, const Tile& tile) {
  const CellBox cells = CellsOf(index);
  CellBox known{cells.row_end, cells.row_begin, cells.col_end, cells.col_begin};
  for (int32_t row = 0; row < kTileSide; ++row) {
    for (int32_t col = 0; col < kTileSide; ++col) {
      if (IsUnknown(tile.at(row, col))) continue;
      known.row_begin = std::min(known.row_begin, cells.row_begin + row);
      known.row_end = std::max(known.row_end, cells.row_begin + row + 1);
      known.col_begin = std::min(known.col_begin, cells.col_begin + col);
      known.col_end = std::max(known.col_end, cells.col_begin + col + 1);
    }
  }
  return known;
}

// Returns the smallest box around the known cells.
CellBox KnownCells(const GridLayer& grid) {
  CellBox known;
  for (const auto& [index, tile] : grid.tiles()) {
    if (IsCancelled()) break;
    known = known.Union(KnownCellsOf(index, *tile));
  }
  return known;
}

absl::Status TooMany(absl::string_view name, absl::string_view what, int64_t number, int64_t most) {
  return absl::ResourceExhaustedError(absl::StrCat(
      name, " has ", number, " ", what, ", more than the ", most, " that can be matched"));
}

}  // namespace

absl::StatusOr<WallMap> WallMap::Make(const GridLayer& grid, absl::string_view name) {
  if (grid.geometry().resolution_m > kMaxResolution_m) {
    return absl::FailedPreconditionError(
        absl::StrCat(name, " has cells of ", grid.geometry().resolution_m,
                     " m, but only cells of at most ", kMaxResolution_m, " m can be matched"));
  }
  const CellBox known = KnownCells(grid);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (known.num_cells() > kMaxCells) {
    return TooMany(name, "cells in the box around all known ones", known.num_cells(), kMaxCells);
  }
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfCell * known.num_cells()));
  FloorPlan plan = ReadFloorPlan(grid, known);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  const int64_t walls = std::count(plan.values().begin(), plan.values().end(), Floor::kOccupied);
  if (walls == 0) {
    return absl::FailedPreconditionError(absl::StrCat(name, " has no occupied cells"));
  }
  if (walls > kMaxWalls) return TooMany(name, "occupied cells", walls, kMaxWalls);
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfWall * walls));
  WallMap map(grid.geometry(), std::move(plan));
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return map;
}

WallMap::WallMap(const GridGeometry& geometry, FloorPlan plan)
    : geometry_(geometry),
      plan_(std::move(plan)),
      distance_(
          geometry, plan_.box(),
          [this](const CellIndex& cell) { return plan_.at(cell) == Floor::kOccupied; }, kReach_m) {
  CollectWalls();
  if (!walls_.empty()) Measure();
}

void WallMap::CollectWalls() {
  const std::vector<Floor>& floors = plan_.values();
  for (size_t i = 0; i < floors.size(); ++i) {
    if (i % kCellsPerLook == 0 && IsCancelled()) return;
    if (floors[i] != Floor::kOccupied) continue;
    const Point centre = geometry_.CentreOf(plan_.CellOf(i));
    walls_.emplace_back(centre.x, centre.y);
    bounds_.Extend(centre);
  }
}

void WallMap::Measure() {
  const auto number = static_cast<double>(walls_.size());
  // Relative to one of the walls, so that it does not round far from the origin.
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& wall : walls_) sum += wall - walls_[0];
  centre_ = walls_[0] + sum / number;
  double squares = 0.0;
  double farthest = 0.0;
  for (const Eigen::Vector2d& wall : walls_) {
    const double square = (wall - centre_).squaredNorm();
    squares += square;
    farthest = std::max(farthest, square);
  }
  spread_m_ = std::sqrt(squares / number);
  radius_m_ = std::sqrt(farthest);
}

Floor WallMap::FloorAt(const Eigen::Vector2d& place) const {
  const auto cell = geometry_.CellAt({place.x(), place.y()});
  return cell ? plan_.at(*cell) : Floor::kUnknown;
}

}  // namespace hypermap::registration
