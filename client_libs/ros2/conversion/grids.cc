#include "client_libs/ros2/conversion/grids.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hypermap::ros2 {
namespace {

constexpr int8_t kFree = 0;
constexpr int8_t kOccupied = 100;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Calls `visit(box, tile)` for the tiles in `within`, each with its cells there; null: never
// written.
template <typename Visit>
void VisitTiles(const GridLayer& layer, const CellBox& within, Visit visit) {
  if (within.empty()) return;
  const TileIndex first = TileOf({within.row_begin, within.col_begin});
  const TileIndex last = TileOf({within.row_end - 1, within.col_end - 1});
  for (int32_t row = first.row; row <= last.row; ++row) {
    for (int32_t col = first.col; col <= last.col; ++col) {
      const auto it = layer.tiles().find({row, col});
      const Tile* const tile = it == layer.tiles().end() ? nullptr : it->second.get();
      visit(CellsOf({row, col}).Intersection(within), tile);
    }
  }
}

CellCode CodeIn(const Tile* tile, int32_t row, int32_t col) {
  if (tile == nullptr) return kUnknownCode;
  const CellBox cells = CellsOf(TileOf({row, col}));
  return tile->at(row - cells.row_begin, col - cells.col_begin);
}

std::vector<int8_t> BytesIn(const GridLayer& layer, const CellBox& box, GridMode mode) {
  const CellBytes byte_of(layer, mode);
  std::vector<int8_t> bytes(box.num_cells(), kUnknownByte);
  VisitTiles(layer, box, [&](const CellBox& cells, const Tile* tile) {
    if (tile == nullptr) return;
    const TileIndex index = TileOf({cells.row_begin, cells.col_begin});
    const CellBox whole = CellsOf(index);
    for (int32_t row = cells.row_begin; row < cells.row_end; ++row) {
      for (int32_t col = cells.col_begin; col < cells.col_end;) {
        const int32_t row_in_tile = row - whole.row_begin;
        const int32_t col_in_tile = col - whole.col_begin;
        const int32_t end = whole.col_begin + tile->EndOfRun(row_in_tile, col_in_tile,
                                                             cells.col_end - whole.col_begin);
        int8_t* const begin = &bytes[(row - box.row_begin) * box.cols() + (col - box.col_begin)];
        std::fill_n(begin, end - col, byte_of(tile->at(row_in_tile, col_in_tile)));
        col = end;
      }
    }
  });
  return bytes;
}

// Extends `box` by the cells of `cells` in which two tiles differ.
void ExtendByChanges(const CellBox& cells, const Tile* before, const Tile* after, CellBox* box) {
  for (int32_t row = cells.row_begin; row < cells.row_end; ++row) {
    for (int32_t col = cells.col_begin; col < cells.col_end; ++col) {
      if (SameCode(CodeIn(before, row, col), CodeIn(after, row, col))) continue;
      *box = box->Union({row, row + 1, col, col + 1});
    }
  }
}

}  // namespace

builtin_interfaces::Time ToTime(absl::Time time) {
  const int64_t seconds = absl::ToUnixSeconds(time);
  const absl::Duration rest = time - absl::FromUnixSeconds(seconds);
  return {static_cast<int32_t>(seconds), static_cast<uint32_t>(absl::ToInt64Nanoseconds(rest))};
}

CellBytes::CellBytes(const GridLayer& layer, GridMode mode)
    : layer_(layer),
      mode_(mode),
      range_(layer.domain().Range().value_or(CellValueRange{kInfinity, -kInfinity})) {
  if (layer.domain().Range().has_value()) return;
  VisitTiles(layer, layer.extent(), [this](const CellBox& cells, const Tile* tile) {
    for (int32_t row = cells.row_begin; tile != nullptr && row < cells.row_end; ++row) {
      for (int32_t col = cells.col_begin; col < cells.col_end; ++col) {
        const CellCode code = CodeIn(tile, row, col);
        if (IsUnknown(code)) continue;
        const double value = layer_.domain().Decode(code);
        range_ = {std::min(range_.min, value), std::max(range_.max, value)};
      }
    }
  });
}

int8_t CellBytes::operator()(CellCode code) const {
  if (IsUnknown(code)) return kUnknownByte;
  const double value = layer_.domain().Decode(code);
  if (layer_.spec().kind != LayerKind::kScalar) return ByteOf(layer_.spec(), value, mode_);
  if (range_.max <= range_.min) return kFree;
  const double part = (value - range_.min) / (range_.max - range_.min);
  return static_cast<int8_t>(std::lround(kOccupied * part));
}

int8_t ByteOf(const LayerSpec& spec, double value, GridMode mode) {
  if (spec.kind != LayerKind::kOccupancy) {
    return static_cast<int8_t>(std::lround(kOccupied * value));
  }
  const OccupancyThresholds& limits = spec.thresholds;
  if (value < limits.free_below) return kFree;
  if (value > limits.occupied_above) return kOccupied;
  if (mode == GridMode::kTrinary) return kUnknownByte;
  const double width = limits.occupied_above - limits.free_below;
  const double part = width > 0.0 ? (value - limits.free_below) / width : 0.5;
  return static_cast<int8_t>(1 + std::lround(98.0 * part));
}

nav_msgs::MapMetaData MetaDataOf(const GridLayer& layer, absl::Time stamp) {
  const CellBox& extent = layer.extent();
  const GridGeometry& geometry = layer.geometry();
  nav_msgs::MapMetaData info;
  info.map_load_time = ToTime(stamp);
  info.resolution = static_cast<float>(geometry.resolution_m);
  info.width = static_cast<uint32_t>(extent.cols());
  info.height = static_cast<uint32_t>(extent.rows());
  const Point corner = geometry.layer_from_grid * Point{extent.col_begin * geometry.resolution_m,
                                                        extent.row_begin * geometry.resolution_m};
  const double yaw = geometry.layer_from_grid.yaw();
  info.origin.position = {corner.x, corner.y, 0.0};
  info.origin.orientation = {0.0, 0.0, std::sin(yaw / 2), std::cos(yaw / 2)};
  return info;
}

nav_msgs::OccupancyGrid ToOccupancyGrid(const GridLayer& layer, GridMode mode, absl::Time stamp) {
  nav_msgs::OccupancyGrid grid;
  grid.header = {ToTime(stamp), layer.spec().frame_id};
  grid.info = MetaDataOf(layer, stamp);
  grid.data = BytesIn(layer, layer.extent(), mode);
  return grid;
}

map_msgs::OccupancyGridUpdate ToUpdate(const GridLayer& layer, const CellBox& box, GridMode mode,
                                       absl::Time stamp) {
  map_msgs::OccupancyGridUpdate update;
  update.header = {ToTime(stamp), layer.spec().frame_id};
  update.x = box.col_begin - layer.extent().col_begin;
  update.y = box.row_begin - layer.extent().row_begin;
  update.width = static_cast<uint32_t>(box.cols());
  update.height = static_cast<uint32_t>(box.rows());
  update.data = BytesIn(layer, box, mode);
  return update;
}

CellBox ChangedCells(const GridLayer& before, const GridLayer& after) {
  CellBox changed;
  VisitTiles(after, after.extent(), [&](const CellBox& cells, const Tile* tile) {
    const auto it = before.tiles().find(TileOf({cells.row_begin, cells.col_begin}));
    const Tile* const old = it == before.tiles().end() ? nullptr : it->second.get();
    if (old != tile) ExtendByChanges(cells, old, tile, &changed);
  });
  return changed;
}

bool CanUpdate(const GridLayer& before, const GridLayer& after) {
  // The bytes of a scalar layer depend on the values of all its cells.
  return before.spec() == after.spec() && before.extent() == after.extent() &&
         before.domain().Range().has_value();
}

}  // namespace hypermap::ros2
