#include "map/exploration/block_sums.h"

namespace hypermap {

BlockSums::BlockSums(const CellBox& box, absl::FunctionRef<bool(const CellIndex&)> is_marked)
    : box_(box),
      block_rows_((box.rows() + kSide - 1) / kSide),
      block_cols_((box.cols() + kSide - 1) / kSide),
      sums_(static_cast<size_t>((block_rows_ + 1) * (block_cols_ + 1)), 0) {
  for (int32_t row = box_.row_begin; row < box_.row_end; ++row) {
    const int64_t block_row = (row - box_.row_begin) / kSide;
    for (int32_t col = box_.col_begin; col < box_.col_end; ++col) {
      const int64_t block_col = (col - box_.col_begin) / kSide;
      if (is_marked({row, col})) ++sums_[At(block_row + 1, block_col + 1)];
    }
  }
  for (int64_t row = 1; row <= block_rows_; ++row) {
    for (int64_t col = 1; col <= block_cols_; ++col) {
      sums_[At(row, col)] +=
          sums_[At(row - 1, col)] + sums_[At(row, col - 1)] - sums_[At(row - 1, col - 1)];
    }
  }
}

int64_t BlockSums::AtMost(const CellBox& part) const {
  const CellBox within = box_.Intersection(part);
  if (within.empty()) return 0;
  const int64_t top = (within.row_begin - box_.row_begin) / kSide;
  const int64_t bottom = (within.row_end - 1 - box_.row_begin) / kSide + 1;
  const int64_t left = (within.col_begin - box_.col_begin) / kSide;
  const int64_t right = (within.col_end - 1 - box_.col_begin) / kSide + 1;
  return sums_[At(bottom, right)] - sums_[At(top, right)] - sums_[At(bottom, left)] +
         sums_[At(top, left)];
}

}  // namespace hypermap
