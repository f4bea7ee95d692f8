// Runs of columns.
#ifndef HYPERMAP_MAP_LAYERS_GRID_COLUMN_SPAN_H_
#define HYPERMAP_MAP_LAYERS_GRID_COLUMN_SPAN_H_

#include <cstdint>
#include <vector>

namespace hypermap {

// Columns col_begin <= col < col_end of one row.
struct ColumnSpan {
  int32_t col_begin = 0;
  int32_t col_end = 0;

  friend bool operator==(const ColumnSpan&, const ColumnSpan&) = default;
};

// Sorts, and unites what overlaps or adjoins.
std::vector<ColumnSpan> Union(std::vector<ColumnSpan> spans);

// What is in `spans` but not in `without`; both sorted and apart.
std::vector<ColumnSpan> Difference(const std::vector<ColumnSpan>& spans,
                                   const std::vector<ColumnSpan>& without);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_COLUMN_SPAN_H_
