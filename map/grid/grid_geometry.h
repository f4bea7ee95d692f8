// Cells, boxes of cells, and their position in the plane.
#ifndef HYPERMAP_MAP_GRID_GRID_GEOMETRY_H_
#define HYPERMAP_MAP_GRID_GRID_GEOMETRY_H_

#include <algorithm>
#include <cstdint>
#include <optional>

#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"

namespace hypermap {

// Rows count along the grid's y axis and columns along its x axis, from the grid's origin; they are
// negative below it and left of it.
struct CellIndex {
  int32_t row = 0;
  int32_t col = 0;

  friend auto operator<=>(const CellIndex&, const CellIndex&) = default;
};

// The cells with row_begin <= row < row_end and col_begin <= col < col_end.
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
  // Returns the smallest box that contains both; an empty box adds nothing.
  CellBox Union(const CellBox& b) const;
  CellBox Intersection(const CellBox& b) const;

  friend bool operator==(const CellBox&, const CellBox&) = default;
};

// The cells col_begin <= col < col_end of a row, which have the same value; nullopt means unknown.
struct CellRun {
  int32_t row = 0;
  int32_t col_begin = 0;
  int32_t col_end = 0;
  std::optional<double> value;

  friend bool operator==(const CellRun&, const CellRun&) = default;
};

// Valid indices of cells are in [-kMaxCellIndex, kMaxCellIndex).
inline constexpr int32_t kMaxCellIndex = 1 << 22;
inline constexpr CellBox kAllCells{-kMaxCellIndex, kMaxCellIndex, -kMaxCellIndex, kMaxCellIndex};

// Square cells with sides of `resolution_m` metres, in a frame that may be rotated against the
// layer's.
struct GridGeometry {
  // The pose of the lower left corner of cell (0, 0) in the layer's frame.
  PlanarTransform layer_from_grid;
  double resolution_m = 0.05;

  // Returns the cell that contains `p` (layer frame): floor((p - origin) / resolution) along each
  // axis of the grid. nullopt if the index is not valid.
  std::optional<CellIndex> CellAt(const Point& p) const;
  // Returns the centre of a cell in the layer's frame: origin + (index + 0.5) * resolution along
  // each axis.
  Point CentreOf(const CellIndex& cell) const;
  // Returns the closed square of a cell in the layer's frame: corners at origin + (index + 0 or 1)
  // * resolution along each axis.
  Polygon SquareOf(const CellIndex& cell) const;
  // Returns the closed bounding box, in the layer's frame, of the four corners of `box`.
  Box BoundsOf(const CellBox& box) const;

  friend bool operator==(const GridGeometry&, const GridGeometry&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_GRID_GEOMETRY_H_
