// Which cells a polygon covers.
#ifndef HYPERMAP_MAP_LAYERS_GRID_CELL_COVER_H_
#define HYPERMAP_MAP_LAYERS_GRID_CELL_COVER_H_

#include <cstdint>
#include <vector>

#include "map/geometry/polygon.h"
#include "map/layers/grid/grid_geometry.h"

namespace hypermap {

// When a cell counts as selected by a polygon.
enum class CellRule {
  kCentre,   // its centre is covered
  kCovered,  // all of the closed cell square is covered
  kTouched,  // the closed cell square and the polygon share a point
};

// Columns col_begin <= col < col_end of one row.
struct ColumnSpan {
  int32_t col_begin = 0;
  int32_t col_end = 0;

  friend bool operator==(const ColumnSpan&, const ColumnSpan&) = default;
};

// Walks the selected cells row by row. Exact: a cell is selected if and only if the predicate of
// its rule holds for GridGeometry::CentreOf (or its square's corners) and the polygon as given; the
// work per row is that of the edges that meet the row, not of the cells.
class CellCover {
 public:
  // `polygon` in the layer's frame. Only cells in `within` are selected.
  CellCover(const Polygon& polygon, const GridGeometry& geometry, const CellBox& within,
            CellRule rule = CellRule::kCentre);

  // A box of cells outside of which nothing is selected; may be empty.
  const CellBox& bounds() const { return bounds_; }

  // The selected spans of a row, sorted, apart and not empty.
  std::vector<ColumnSpan> SpansOfRow(int32_t row) const;

 private:
  bool Selected(const CellIndex& cell) const;

  Polygon polygon_;
  // The polygon in units of cells: cell (r, c) is the unit square at (c, r).
  Polygon in_cells_;
  GridGeometry geometry_;
  CellRule rule_;
  CellBox bounds_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_CELL_COVER_H_
