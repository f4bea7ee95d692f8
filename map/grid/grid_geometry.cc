#include "map/grid/grid_geometry.h"

#include <cmath>

namespace hypermap {

CellBox CellBox::Union(const CellBox& b) const {
  if (b.empty()) return *this;
  if (empty()) return b;
  return {std::min(row_begin, b.row_begin), std::max(row_end, b.row_end),
          std::min(col_begin, b.col_begin), std::max(col_end, b.col_end)};
}

CellBox CellBox::Intersection(const CellBox& b) const {
  const CellBox common{std::max(row_begin, b.row_begin), std::min(row_end, b.row_end),
                       std::max(col_begin, b.col_begin), std::min(col_end, b.col_end)};
  return common.empty() ? CellBox() : common;
}

std::optional<CellIndex> GridGeometry::CellAt(const Point& p) const {
  const Point in_grid = layer_from_grid.ApplyInverse(p);
  const double row = std::floor(in_grid.y / resolution_m);
  const double col = std::floor(in_grid.x / resolution_m);
  // The comparisons are false for NaN.
  const auto valid = [](double index) { return index >= -kMaxCellIndex && index < kMaxCellIndex; };
  if (!valid(row) || !valid(col)) return std::nullopt;
  return CellIndex{static_cast<int32_t>(row), static_cast<int32_t>(col)};
}

Point GridGeometry::CentreOf(const CellIndex& cell) const {
  return layer_from_grid * Point{(cell.col + 0.5) * resolution_m, (cell.row + 0.5) * resolution_m};
}

Polygon GridGeometry::SquareOf(const CellIndex& cell) const {
  const Box in_grid{{cell.col * resolution_m, cell.row * resolution_m},
                    {(cell.col + 1.0) * resolution_m, (cell.row + 1.0) * resolution_m}};
  return layer_from_grid * Polygon::FromBox(in_grid);
}

Box GridGeometry::BoundsOf(const CellBox& box) const {
  if (box.empty()) return Box();
  return hypermap::BoundsOf(layer_from_grid,
                            Box{{box.col_begin * resolution_m, box.row_begin * resolution_m},
                                {box.col_end * resolution_m, box.row_end * resolution_m}});
}

}  // namespace hypermap
