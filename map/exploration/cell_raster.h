// A value for each cell of a box.
#ifndef HYPERMAP_MAP_EXPLORATION_CELL_RASTER_H_
#define HYPERMAP_MAP_EXPLORATION_CELL_RASTER_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/hash/hash.h"
#include "base/cancellation/cancellation.h"
#include "map/grid/grid_geometry.h"

namespace hypermap {

// From a cell to those that share a side with it.
inline constexpr std::array<CellIndex, 4> kSides{{{-1, 0}, {0, -1}, {0, 1}, {1, 0}}};

// Loops over all cells of a raster check for cancellation after this many.
inline constexpr size_t kCellsPerLook = 4096;

// For hash tables.
struct CellHash {
  size_t operator()(const CellIndex& cell) const {
    return absl::Hash<std::pair<int32_t, int32_t>>()({cell.row, cell.col});
  }
};

// Row-major, lowest row first. Cells outside the box have the value `outside`.
template <typename T>
class CellRaster {
 public:
  CellRaster() = default;
  // All cells have the value `outside`. Has no cells if the work of this thread is cancelled:
  // filling the raster of a large floor takes a while.
  explicit CellRaster(const CellBox& box, T outside = T()) : outside_(outside) {
    const auto num_cells = static_cast<size_t>(box.num_cells());
    values_.reserve(num_cells);
    while (values_.size() < num_cells) {
      if (IsCancelled()) {
        values_ = {};
        return;
      }
      values_.insert(values_.end(), std::min(16 * kCellsPerLook, num_cells - values_.size()),
                     outside);
    }
    box_ = box;
  }

  const CellBox& box() const { return box_; }
  bool Contains(const CellIndex& cell) const { return box_.Contains(cell); }
  T at(const CellIndex& cell) const { return Contains(cell) ? values_[IndexOf(cell)] : outside_; }
  // REQUIRES: `cell` is in the box.
  void set(const CellIndex& cell, T value) { values_[IndexOf(cell)] = value; }

  // IndexOf returns the position of a cell of the box in values(); CellOf is its inverse.
  size_t IndexOf(const CellIndex& cell) const {
    return static_cast<size_t>(cell.row - box_.row_begin) * box_.cols() +
           static_cast<size_t>(cell.col - box_.col_begin);
  }
  CellIndex CellOf(size_t index) const {
    // Not cols(), which is 0 for an empty box: that has no positions.
    const auto cols = static_cast<size_t>(int64_t{box_.col_end} - box_.col_begin);
    return {box_.row_begin + static_cast<int32_t>(index / cols),
            box_.col_begin + static_cast<int32_t>(index % cols)};
  }
  const std::vector<T>& values() const { return values_; }
  std::vector<T>& mutable_values() { return values_; }

 private:
  CellBox box_;
  T outside_ = T();
  std::vector<T> values_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EXPLORATION_CELL_RASTER_H_
