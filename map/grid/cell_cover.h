// Selects the cells that a polygon covers.
#ifndef HYPERMAP_MAP_GRID_CELL_COVER_H_
#define HYPERMAP_MAP_GRID_CELL_COVER_H_

#include <cstdint>

#include "map/geometry/polygon.h"
#include "map/grid/cell_rule.h"
#include "map/grid/column_span.h"
#include "map/grid/grid_geometry.h"
#include "map/grid/row_scan.h"

namespace hypermap {

// Returns the selected cells row by row, exactly: a cell is selected if and only if the predicate
// of its rule holds for the polygon as given and GridGeometry::CentreOf (or the corners of the
// cell's square, computed in the same way). A row costs as much as the edges that meet it, whatever
// the number of cells. In a rotated grid, the cells within rounding of an edge are tested one by
// one. Immutable; safe to read from many threads.
class CellCover {
 public:
  // `polygon` is in the layer's frame. Only cells in `within` are selected.
  CellCover(const Polygon& polygon, const GridGeometry& geometry, const CellBox& within,
            CellRule rule = CellRule::kCentre);

  // Returns bounds() of such a cover, whatever the rule. Linear in the vertices.
  static CellBox BoundsOf(const Polygon& polygon, const GridGeometry& geometry,
                          const CellBox& within);

  // A box that contains all selected cells; may be empty.
  const CellBox& bounds() const { return bounds_; }

  // Returns the selected spans of a row: sorted, disjoint and not empty. If IsCancelled(), any
  // spans between the columns of bounds().
  ColumnSpans SpansOfRow(int32_t row) const;

  // Returns a row after `row` such that all rows before it have the spans of `row`. For a
  // rectilinear area in a grid that is not rotated, one call skips many rows; otherwise the result
  // may be row + 1.
  int32_t EndOfLikeRows(int32_t row) const;

 private:
  // For a grid that is not rotated.
  Lattice CentresOrSquares() const;
  // Evaluates the predicate of the rule in the layer's frame.
  bool Selected(const CellIndex& cell) const;
  ColumnSpans SpansOfTurnedRow(int32_t row) const;

  GridGeometry geometry_;
  CellRule rule_;
  // For a rotated grid: the polygon, and the error bound, in cells, of coordinates in the grid's
  // axes.
  Polygon polygon_;
  double rounding_;
  CellBox bounds_;
  // Scans the polygon as given; for a rotated grid, the polygon in units of cells.
  RowScan scan_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_CELL_COVER_H_
