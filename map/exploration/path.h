// Ways over a grid.
#ifndef HYPERMAP_MAP_EXPLORATION_PATH_H_
#define HYPERMAP_MAP_EXPLORATION_PATH_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/exploration/cell_raster.h"

namespace hypermap {

// The cells that can be reached from one, nearest first (Dijkstra's algorithm, with Dial's
// buckets). Steps go to the eight neighbours, and past a corner only where both cells beside it can
// be crossed. Lengths are in tenths of a cell: 10 along an axis, 14 aslant. Reused from search to
// search; a search costs what it visits. Not thread safe.
class PathSearch {
 public:
  static constexpr int32_t kStraight = 10;
  static constexpr int32_t kAslant = 14;

  explicit PathSearch(const CellBox& box);

  // Calls visit(cell, length) with `start` and all that can be reached from it over passable cells
  // of the box, by their lengths, until it returns false. `start`, of the box, need not be
  // passable.
  void Run(const CellIndex& start, absl::FunctionRef<bool(const CellIndex&)> passable,
           absl::FunctionRef<bool(const CellIndex&, int32_t)> visit);

  // A shortest way of the last search from its start to a cell that it visited, both included.
  std::vector<CellIndex> PathTo(const CellIndex& cell) const;

 private:
  static constexpr int32_t kFar = INT32_MAX;

  void Forget();

  CellRaster<int32_t> lengths_;     // kFar: not seen
  CellRaster<uint8_t> came_by_;     // the step that led there
  std::vector<CellIndex> touched_;  // of lengths_
  CellIndex start_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_PATH_H_
