// Runs of columns.
#ifndef HYPERMAP_MAP_GRID_COLUMN_SPAN_H_
#define HYPERMAP_MAP_GRID_COLUMN_SPAN_H_

#include <cstdint>

#include "absl/container/inlined_vector.h"

namespace hypermap {

// Columns col_begin <= col < col_end of one row.
struct ColumnSpan {
  int32_t col_begin = 0;
  int32_t col_end = 0;

  friend bool operator==(const ColumnSpan&, const ColumnSpan&) = default;
};

// Of one row; seldom more than a few.
using ColumnSpans = absl::InlinedVector<ColumnSpan, 4>;

// Sorts, and unites what overlaps or adjoins.
ColumnSpans Union(ColumnSpans spans);

// What is in `spans` but not in `without`; both sorted and apart.
ColumnSpans Difference(const ColumnSpans& spans, const ColumnSpans& without);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_COLUMN_SPAN_H_
