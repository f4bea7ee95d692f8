// Rows of equal rectangles against a polygon whose axes are theirs, decided exactly.
//
// The comparisons behind every answer are between coordinates as doubles or signs of Orientation;
// nothing is intersected in floating point. Private to this folder.
#ifndef HYPERMAP_MAP_GRID_ROW_SCAN_H_
#define HYPERMAP_MAP_GRID_ROW_SCAN_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "map/geometry/polygon.h"
#include "map/grid/column_span.h"

namespace hypermap {

// Cell (row, col) is the closed rectangle from origin + (index + low) * step to
// origin + (index + high) * step along each axis, computed in doubles in just that way; a point
// when low == high. Steps must be large against the rounding of these coordinates.
struct Lattice {
  Point origin;
  double step = 1.0;
  double low = 0.0;
  double high = 1.0;
};

// Immutable and safe to read from many threads.
class RowScan {
 public:
  // Answers speak of the columns col_begin <= col < col_end. The polygon must be valid, but for
  // crossings closer to an edge than the caller looks.
  RowScan(const Polygon& polygon, int32_t col_begin, int32_t col_end);

  // The cells of a row that share a point with the polygon, sorted and apart. Works on the edges
  // that meet the row: O(log n + k log k) for k of n.
  ColumnSpans Touched(const Lattice& lattice, int32_t row) const;

  // The cells of a row that the polygon covers; low < high. Same cost.
  ColumnSpans Covered(const Lattice& lattice, int32_t row) const;

  // A row after `row` such that all rows before it touch as `row` does; low == high. More than the
  // next one only for polygons whose edges are all level or upright.
  int32_t EndOfLikeRows(const Lattice& lattice, int32_t row) const;

 private:
  struct Edge {
    Point low, high;       // low.y <= high.y
    double subtree_max_y;  // of the subtree that this edge is the root of
  };
  // A place on an edge: its end, or where it passes a height.
  class Place;
  enum class Side { kAtOrRight, kRight };
  // The first column at or right of a place, and the first one only right of it.
  struct FirstColumns {
    int32_t at_or_right, right;
  };

  double BuildTree(int begin, int end);
  // Calls `visit` with the edges that share a point with y_min <= y <= y_max.
  template <typename Visit>
  void VisitEdges(double y_min, double y_max, const Visit& visit) const;
  template <typename Visit>
  void VisitSubtree(int begin, int end, double y_min, double y_max, const Visit& visit) const;

  // Touched for low == high.
  ColumnSpans TouchedPoints(const Lattice& lattice, int32_t row) const;

  // The first columns whose x is origin + (col + offset) * step; col_end when there is none.
  FirstColumns ColumnsFrom(const Lattice& lattice, double offset, const Place& place) const;
  int32_t FirstColumn(const Lattice& lattice, double offset, const Place& place, Side side) const;
  // The same by looking, beginning near `guess`.
  int32_t FindColumn(const Lattice& lattice, double offset, const Place& place, Side side,
                     double guess) const;
  // The column after a guess that lies between two columns, farther from both than it may be off:
  // then there is nothing to look for.
  std::optional<int32_t> ColumnAfter(double guess, double error) const;

  // Sorted by low.y; the middle of every range is the root of a search tree over it.
  std::vector<Edge> edges_;
  int32_t col_begin_;
  int32_t col_end_;
  bool is_rectilinear_ = true;  // all edges are level or upright
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_ROW_SCAN_H_
