#include "map/grid/column_span.h"

#include <algorithm>
#include <cstddef>

namespace hypermap {

ColumnSpans Union(ColumnSpans spans) {
  std::sort(spans.begin(), spans.end(),
            [](const ColumnSpan& a, const ColumnSpan& b) { return a.col_begin < b.col_begin; });
  // In place: a union never has more spans than its parts.
  size_t num_united = 0;
  for (const ColumnSpan& span : spans) {
    if (span.col_begin >= span.col_end) continue;
    if (num_united > 0 && span.col_begin <= spans[num_united - 1].col_end) {
      ColumnSpan& last = spans[num_united - 1];
      last.col_end = std::max(last.col_end, span.col_end);
    } else {
      spans[num_united++] = span;
    }
  }
  spans.resize(num_united);
  return spans;
}

ColumnSpans Difference(const ColumnSpans& spans, const ColumnSpans& without) {
  ColumnSpans left;
  auto cut = without.begin();
  for (const ColumnSpan& span : spans) {
    int32_t begin = span.col_begin;
    while (cut != without.end() && cut->col_end <= begin) ++cut;
    for (auto c = cut; c != without.end() && c->col_begin < span.col_end; ++c) {
      if (begin < c->col_begin) left.push_back({begin, c->col_begin});
      begin = c->col_end;
    }
    if (begin < span.col_end) left.push_back({begin, span.col_end});
  }
  return left;
}

}  // namespace hypermap
