// Rows of equal rectangles against a polygon whose axes are theirs, decided exactly.
//
// The comparisons behind every answer are between coordinates as doubles or signs of Orientation;
// nothing is intersected in floating point. Private to this folder.
#ifndef HYPERMAP_MAP_LAYERS_GRID_ROW_SCAN_H_
#define HYPERMAP_MAP_LAYERS_GRID_ROW_SCAN_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/geometry/polygon.h"
#include "map/layers/grid/column_span.h"

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
  std::vector<ColumnSpan> Touched(const Lattice& lattice, int32_t row) const;

  // The cells of a row that the polygon covers; low < high. Same cost.
  std::vector<ColumnSpan> Covered(const Lattice& lattice, int32_t row) const;

 private:
  struct Edge {
    Point low, high;       // low.y <= high.y
    double subtree_max_y;  // of the subtree that this edge is the root of
  };
  // A place on an edge: its end, or where it passes a height.
  class Place;
  enum class Side { kAtOrRight, kRight };

  double BuildTree(int begin, int end);
  // Calls `visit` with the edges that share a point with y_min <= y <= y_max.
  void VisitEdges(double y_min, double y_max, absl::FunctionRef<void(const Edge&)> visit) const;
  void VisitSubtree(int begin, int end, double y_min, double y_max,
                    absl::FunctionRef<void(const Edge&)> visit) const;

  // The first column whose x (origin + (col + offset) * step) is at or right of the place, or only
  // right of it; col_end when there is none.
  int32_t FirstColumn(const Lattice& lattice, double offset, const Place& place, Side side) const;

  // Sorted by low.y; the middle of every range is the root of a search tree over it.
  std::vector<Edge> edges_;
  int32_t col_begin_;
  int32_t col_end_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_ROW_SCAN_H_
