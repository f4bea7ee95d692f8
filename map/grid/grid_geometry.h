// Cells, boxes of cells, and where they lie in the plane.
#ifndef HYPERMAP_MAP_GRID_GRID_GEOMETRY_H_
#define HYPERMAP_MAP_GRID_GRID_GEOMETRY_H_

#include <algorithm>
#include <cstdint>
#include <optional>

#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// Rows count along the grid's y axis, columns along its x axis, both from the grid's origin;
// negative below and left of it.
struct CellIndex {
  int32_t row = 0;
  int32_t col = 0;

  friend auto operator<=>(const CellIndex&, const CellIndex&) = default;
};

// Cells with row_begin <= row < row_end and col_begin <= col < col_end.
struct CellBox {
  int32_t row_begin = 0;
  int32_t row_end = 0;
  int32_t col_begin = 0;
  int32_t col_end = 0;

  bool empty() const { return row_begin >= row_end || col_begin >= col_end; }
  int64_t rows() const { return empty() ? 0 : int64_t{row_end} - row_begin; }
  int64_t cols() const { return empty() ? 0 : int64_t{col_end} - col_begin; }
  int64_t num_cells() const { return rows() * cols(); }
  bool Contains(const CellIndex& c) const {
    return c.row >= row_begin && c.row < row_end && c.col >= col_begin && c.col < col_end;
  }
  bool Contains(const CellBox& b) const {
    return b.empty() || (b.row_begin >= row_begin && b.row_end <= row_end &&
                         b.col_begin >= col_begin && b.col_end <= col_end);
  }
  // The smallest box that holds both; an empty box adds nothing.
  CellBox Union(const CellBox& b) const;
  CellBox Intersection(const CellBox& b) const;

  friend bool operator==(const CellBox&, const CellBox&) = default;
};

// Cells row_, col_begin <= col < col_end that share a value.
// A value of nullopt is "unknown".
struct CellRun {
  int32_t row = 0;
  int32_t col_begin = 0;
  int32_t col_end = 0;
  std::optional<double> value;

  friend bool operator==(const CellRun&, const CellRun&) = default;
};

// Cells may have indices in [-kMaxCellIndex, kMaxCellIndex).
inline constexpr int32_t kMaxCellIndex = 1 << 22;
inline constexpr CellBox kAllCells{-kMaxCellIndex, kMaxCellIndex, -kMaxCellIndex, kMaxCellIndex};

// Square cells of `resolution_m` metres in a frame that may be turned against the layer's.
struct GridGeometry {
  // Pose of the lower left corner of cell (0, 0) in the layer's frame.
  PlanarTransform layer_from_grid;
  double resolution_m = 0.05;

  // The cell that holds `p` (layer frame): floor((p - origin) / resolution) along each axis of the
  // grid. nullopt when that is no valid index.
  std::optional<CellIndex> CellAt(const Point& p) const;
  // The centre of a cell, layer frame: origin + (index + 0.5) * resolution along each axis.
  Point CentreOf(const CellIndex& cell) const;
  // The closed square of a cell, layer frame: corners at origin + (index + 0 or 1) * resolution.
  Polygon SquareOf(const CellIndex& cell) const;
  // The four corners' closed box in the layer's frame.
  Box BoundsOf(const CellBox& box) const;

  friend bool operator==(const GridGeometry&, const GridGeometry&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_GRID_GEOMETRY_H_
