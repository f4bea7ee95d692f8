// Values that are sent to PostgreSQL.
#ifndef HYPERMAP_STORAGE_LIBPQ_PARAMETERS_H_
#define HYPERMAP_STORAGE_LIBPQ_PARAMETERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace hypermap::storage::postgres {

// Bytes that are sent as bytea instead of as text. Does not own them.
struct BlobView {
  absl::string_view bytes;
};

// The parameters of a statement, or the columns of a row, encoded in binary format. Owns its bytes.
class Parameters {
 public:
  // A value in binary format.
  struct Value {
    uint32_t type = 0;  // the object id of its type
    bool is_null = false;
    std::string bytes;
  };

  template <typename... Values>
  explicit Parameters(const Values&... values) {
    values_.reserve(sizeof...(values));
    (Add(values), ...);
  }

  void Add(bool value);
  void Add(int value) { Add(int64_t{value}); }
  void Add(int64_t value);
  void Add(double value);
  void Add(const char* text) { Add(absl::string_view(text)); }
  void Add(const std::string& text) { Add(absl::string_view(text)); }
  void Add(absl::string_view text);
  void Add(const BlobView& blob);
  // Arrays, whose elements are not null: int8[], float8[], text[] and bytea[].
  void Add(absl::Span<const int64_t> values);
  void Add(absl::Span<const double> values);
  void Add(absl::Span<const absl::string_view> values);
  void Add(absl::Span<const BlobView> values);
  // Arrays whose elements may be null: int8[] and float8[].
  void Add(absl::Span<const std::optional<int64_t>> values);
  void Add(absl::Span<const std::optional<double>> values);
  template <typename T>
  void Add(const std::optional<T>& value) {
    if (value) {
      Add(*value);
    } else {
      AddNull(T());
    }
  }

  const std::vector<Value>& values() const { return values_; }
  // INVALID_ARGUMENT if a text is not UTF-8 or has a NUL, which PostgreSQL can't store.
  const absl::Status& status() const { return status_; }

 private:
  void AddNull(bool);
  void AddNull(int) { AddNull(int64_t{0}); }
  void AddNull(int64_t);
  void AddNull(double);
  void AddNull(const std::string&) { AddNull(absl::string_view()); }
  void AddNull(absl::string_view);
  void AddNull(const BlobView&);
  void CheckText(absl::string_view text);
  template <typename T>
  void AddArray(uint32_t type, uint32_t element_type, absl::Span<const T> values);

  std::vector<Value> values_;
  absl::Status status_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_PARAMETERS_H_
