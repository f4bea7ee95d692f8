// Decides exactly which cells of a row a polygon meets, if the axes of polygon and cells are the
// same.
//
// All decisions are comparisons of coordinates as doubles, or signs of Orientation; no intersection
// points are computed in floating point. Private to this folder.
#ifndef HYPERMAP_MAP_GRID_ROW_SCAN_H_
#define HYPERMAP_MAP_GRID_ROW_SCAN_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "map/geometry/polygon.h"
#include "map/grid/column_span.h"

namespace hypermap {

// A grid of equal rectangles. Cell (row, col) is the closed rectangle from origin + (index + low) *
// step to origin + (index + high) * step along each axis, computed in doubles in just this way; a
// point if low == high. `step` must be large compared with the rounding of these coordinates.
struct Lattice {
  Point origin;
  double step = 1.0;
  double low = 0.0;
  double high = 1.0;
};

// Immutable; safe to read from many threads.
class RowScan {
 public:
  // Answers contain only columns col_begin <= col < col_end. The polygon must be valid, except for
  // self-crossings that are too small to matter to the caller.
  RowScan(const Polygon& polygon, int32_t col_begin, int32_t col_end);

  // Returns the cells of a row that share a point with the polygon, sorted and disjoint. O(log n +
  // k log k) for n edges, k of which meet the row.
  ColumnSpans Touched(const Lattice& lattice, int32_t row) const;

  // Returns the cells of a row that the polygon covers. Requires low < high. Same cost.
  ColumnSpans Covered(const Lattice& lattice, int32_t row) const;

  // Returns a row after `row` such that all rows before it touch the same columns. Requires low ==
  // high. Finds more than the next row only if all edges are horizontal or vertical.
  int32_t EndOfLikeRows(const Lattice& lattice, int32_t row) const;

 private:
  struct Edge {
    Point low, high;       // With low.y <= high.y.
    double subtree_max_y;  // Largest y in the subtree whose root is this edge.
  };
  // A point on an edge: one of its ends, or the point at which it crosses a height.
  class Place;
  enum class Side { kAtOrRight, kRight };
  // The first column at or right of a place, and the first one strictly right of it.
  struct FirstColumns {
    int32_t at_or_right, right;
  };

  double BuildTree(int begin, int end);
  // Calls `visit` with the edges that have a point in y_min <= y <= y_max.
  template <typename Visit>
  void VisitEdges(double y_min, double y_max, const Visit& visit) const;
  template <typename Visit>
  void VisitSubtree(int begin, int end, double y_min, double y_max, const Visit& visit) const;

  // Touched if low == high.
  ColumnSpans TouchedPoints(const Lattice& lattice, int32_t row) const;

  // Return the first column at or right of `place` (or only right of it), where the x of a column
  // is origin + (col + offset) * step; col_end if there is none.
  FirstColumns ColumnsFrom(const Lattice& lattice, double offset, const Place& place) const;
  int32_t FirstColumn(const Lattice& lattice, double offset, const Place& place, Side side) const;
  // Does the same by an exact search that begins at `guess`.
  int32_t FindColumn(const Lattice& lattice, double offset, const Place& place, Side side,
                     double guess) const;
  // Returns the column after `guess`, if `guess` is farther than `error` from both neighbouring
  // columns. Then no search is needed.
  std::optional<int32_t> ColumnAfter(double guess, double error) const;

  // Sorted by low.y. The middle of each range is the root of an interval tree over the range.
  std::vector<Edge> edges_;
  int32_t col_begin_;
  int32_t col_end_;
  bool is_rectilinear_ = true;  // All edges are horizontal or vertical.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_ROW_SCAN_H_
