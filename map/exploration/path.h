// Shortest paths over a grid.
#ifndef HYPERMAP_MAP_EXPLORATION_PATH_H_
#define HYPERMAP_MAP_EXPLORATION_PATH_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/exploration/cell_raster.h"

namespace hypermap {

// Finds the cells that can be reached from a cell, nearest first: Dijkstra's algorithm with Dial's
// buckets, which suits small integer lengths. Steps lead to the eight neighbours; a diagonal step
// requires that both cells beside it are passable. Lengths are in tenths of a cell: 10 straight, 14
// diagonal. Reusable; a search costs as much as the cells it visits. Not thread-safe.
class PathSearch {
 public:
  static constexpr int32_t kStraight = 10;
  static constexpr int32_t kAslant = 14;

  explicit PathSearch(const CellBox& box);

  // Calls visit(cell, length) for `start` and the passable cells of the box that can be reached
  // from it, in the order of their lengths, until it returns false. `start` must be in the box, but
  // need not be passable.
  void Run(const CellIndex& start, absl::FunctionRef<bool(const CellIndex&)> passable,
           absl::FunctionRef<bool(const CellIndex&, int32_t)> visit);

  // Returns a shortest path of the last search, from its start to a cell that it visited, including
  // both.
  std::vector<CellIndex> PathTo(const CellIndex& cell) const;

 private:
  static constexpr int32_t kFar = INT32_MAX;

  void Forget();

  CellRaster<int32_t> lengths_;     // kFar: not reached.
  CellRaster<uint8_t> came_by_;     // The step that led to the cell.
  std::vector<CellIndex> touched_;  // Cells whose lengths must be reset.
  CellIndex start_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_PATH_H_
