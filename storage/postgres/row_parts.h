// Rows of a table as arrays, one for each column, of which a statement inserts many at once.
#ifndef HYPERMAP_STORAGE_POSTGRES_ROW_PARTS_H_
#define HYPERMAP_STORAGE_POSTGRES_ROW_PARTS_H_

#include <cstddef>
#include <vector>

#include "absl/types/span.h"

namespace hypermap::storage::postgres {

// The bounds of what one statement inserts.
inline constexpr size_t kMaxRowsOfPart = 1000;
inline constexpr size_t kMaxBytesOfPart = size_t{4} << 20;

// Calls `send` with parts of the rows that are within the bounds; each has one row at least.
// `bytes_of` tells the size of a row.
template <typename Row, typename BytesOf, typename Send>
void InParts(absl::Span<const Row> rows, BytesOf bytes_of, Send send) {
  while (!rows.empty()) {
    size_t count = 1;
    size_t bytes = bytes_of(rows[0]);
    while (count < rows.size() && count < kMaxRowsOfPart) {
      bytes += bytes_of(rows[count]);
      if (bytes > kMaxBytesOfPart) break;
      ++count;
    }
    send(rows.first(count));
    rows.remove_prefix(count);
  }
}

// The values of one column.
template <typename Value, typename Row, typename Get>
std::vector<Value> Column(absl::Span<const Row> rows, Get get) {
  std::vector<Value> values;
  values.reserve(rows.size());
  for (const Row& row : rows) values.push_back(get(row));
  return values;
}

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_ROW_PARTS_H_
