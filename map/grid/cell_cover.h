// Which cells a polygon covers.
#ifndef HYPERMAP_MAP_GRID_CELL_COVER_H_
#define HYPERMAP_MAP_GRID_CELL_COVER_H_

#include <cstdint>

#include "map/geometry/polygon.h"
#include "map/grid/cell_rule.h"
#include "map/grid/column_span.h"
#include "map/grid/grid_geometry.h"
#include "map/grid/row_scan.h"

namespace hypermap {

// Walks the selected cells row by row. Exact: a cell is selected if and only if the predicate of
// its rule holds for GridGeometry::CentreOf (or its square's corners, computed alike) and the
// polygon as given. The work per row is that of the edges that meet the row, not of the cells; in a
// grid that is turned, cells within rounding of an edge are tested against the polygon one by one.
// Immutable and safe to read from many threads.
class CellCover {
 public:
  // `polygon` in the layer's frame. Only cells in `within` are selected.
  CellCover(const Polygon& polygon, const GridGeometry& geometry, const CellBox& within,
            CellRule rule = CellRule::kCentre);

  // A box of cells outside of which nothing is selected; may be empty.
  const CellBox& bounds() const { return bounds_; }

  // The selected spans of a row, sorted, apart and not empty.
  ColumnSpans SpansOfRow(int32_t row) const;

  // A row after `row` such that all rows before it have the spans of `row`. In a box that is nearly
  // all rows; where edges lean it is the next row.
  int32_t EndOfLikeRows(int32_t row) const;

 private:
  // Of a grid that is not turned.
  Lattice CentresOrSquares() const;
  // The rule's predicate itself, in the layer's frame.
  bool Selected(const CellIndex& cell) const;
  ColumnSpans SpansOfTurnedRow(int32_t row) const;

  GridGeometry geometry_;
  CellRule rule_;
  // Of a grid that is turned: the polygon, and how far, in cells, the place of anything in the
  // grid's own axes may be off.
  Polygon polygon_;
  double rounding_;
  CellBox bounds_;
  // Over the polygon as it is; for a turned grid, over the polygon in units of cells.
  RowScan scan_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_CELL_COVER_H_
