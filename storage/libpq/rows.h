// Rows that PostgreSQL answers.
#ifndef HYPERMAP_STORAGE_LIBPQ_ROWS_H_
#define HYPERMAP_STORAGE_LIBPQ_ROWS_H_

#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

// libpq's own type, so that no other room needs its header.
struct pg_result;

namespace hypermap::storage::postgres {

// The rows of an answer, all of which are in memory. Movable. Used by one thread at a time; needs
// its connection no more.
class Rows {
 public:
  Rows() = default;
  explicit Rows(pg_result* result);  // takes it over
  Rows(Rows&& other) noexcept;
  Rows& operator=(Rows&& other) noexcept;
  ~Rows();

  int64_t size() const;
  // The rows that an INSERT, UPDATE or DELETE changed.
  int64_t changed_rows() const;
  // Advances to the next row, at first to the first one; false when there is none.
  bool Next();

  // Columns of the current row, counted from 0; views are valid as long as this lives. A NULL or a
  // column of another type gives a default value and sets row_status, so that rows can be read and
  // checked once.
  bool IsNull(int column) const;
  bool Bool(int column);
  int64_t Int64(int column);           // of int8, int4 or int2
  double Double(int column);           // of float8 or float4
  absl::string_view Text(int column);  // of text, varchar, char(n), name or json
  absl::string_view Blob(int column);  // of bytea
  std::optional<int64_t> OptionalInt64(int column);
  std::optional<double> OptionalDouble(int column);
  // DATA_LOSS naming the first column that was read as another type than it has.
  const absl::Status& row_status() const { return row_status_; }

 private:
  // Returns the column's bytes if it has one of the types and is not NULL; sets row_status if not.
  std::optional<absl::string_view> Read(int column, absl::Span<const uint32_t> types);

  pg_result* result_ = nullptr;
  int row_ = -1;
  absl::Status row_status_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_ROWS_H_
