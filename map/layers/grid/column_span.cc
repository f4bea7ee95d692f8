#include "map/layers/grid/column_span.h"

#include <algorithm>

namespace hypermap {

std::vector<ColumnSpan> Union(std::vector<ColumnSpan> spans) {
  std::sort(spans.begin(), spans.end(),
            [](const ColumnSpan& a, const ColumnSpan& b) { return a.col_begin < b.col_begin; });
  std::vector<ColumnSpan> united;
  for (const ColumnSpan& span : spans) {
    if (span.col_begin >= span.col_end) continue;
    if (!united.empty() && span.col_begin <= united.back().col_end) {
      united.back().col_end = std::max(united.back().col_end, span.col_end);
    } else {
      united.push_back(span);
    }
  }
  return united;
}

std::vector<ColumnSpan> Difference(const std::vector<ColumnSpan>& spans,
                                   const std::vector<ColumnSpan>& without) {
  std::vector<ColumnSpan> left;
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
