// Upper bounds of the number of marked cells in boxes.
#ifndef HYPERMAP_MAP_EXPLORATION_BLOCK_SUMS_H_
#define HYPERMAP_MAP_EXPLORATION_BLOCK_SUMS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/grid/grid_geometry.h"

namespace hypermap {

// Counts the marked cells of a box by blocks of kSide x kSide cells, as a summed-area table (Crow,
// "Summed-area tables for texture mapping", SIGGRAPH 1984), so that a bound takes four additions.
// Uses 8 / kSide² bytes for each cell. A value.
class BlockSums {
 public:
  static constexpr int32_t kSide = 8;

  // `is_marked` is asked once for each cell of `box`.
  BlockSums(const CellBox& box, absl::FunctionRef<bool(const CellIndex&)> is_marked);

  // At least the number of marked cells in `part`, and at most that of all blocks that it touches.
  int64_t AtMost(const CellBox& part) const;

 private:
  size_t At(int64_t block_row, int64_t block_col) const {
    return static_cast<size_t>(block_row * (block_cols_ + 1) + block_col);
  }

  CellBox box_;
  int64_t block_rows_;
  int64_t block_cols_;
  // Entry (r, c) is the number of marked cells in the blocks above row r and left of column c.
  std::vector<int64_t> sums_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_BLOCK_SUMS_H_
