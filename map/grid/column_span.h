// Spans of columns.
#ifndef HYPERMAP_MAP_GRID_COLUMN_SPAN_H_
#define HYPERMAP_MAP_GRID_COLUMN_SPAN_H_

#include <cstdint>

#include "absl/container/inlined_vector.h"

namespace hypermap {

// The columns col_begin <= col < col_end of a row.
struct ColumnSpan {
  int32_t col_begin = 0;
  int32_t col_end = 0;

  friend bool operator==(const ColumnSpan&, const ColumnSpan&) = default;
};

// The spans of a row; seldom more than a few.
using ColumnSpans = absl::InlinedVector<ColumnSpan, 4>;

// Sorts the spans, and joins those that overlap or adjoin.
ColumnSpans Union(ColumnSpans spans);

// Returns the columns of `spans` that are not in `without`. Both must be sorted and disjoint.
ColumnSpans Difference(const ColumnSpans& spans, const ColumnSpans& without);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_COLUMN_SPAN_H_
