#include "storage/libpq/rows.h"

#include <libpq-fe.h>

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "storage/libpq/wire.h"

namespace hypermap::storage::postgres {
namespace {

std::string TypeName(uint32_t type) {
  switch (type) {
    case kBool:
      return "a boolean";
    case kBytea:
      return "a blob";
    case kInt2:
    case kInt4:
    case kInt8:
      return "an integer";
    case kFloat4:
    case kFloat8:
      return "a number";
    case kText:
    case kVarchar:
    case kBpchar:
    case kName:
    case kJson:
      return "text";
    default:
      return absl::StrCat("a value of the type ", type);
  }
}

// The bytes of a value of the type; 0 if they vary.
int SizeOf(uint32_t type) {
  switch (type) {
    case kBool:
      return 1;
    case kInt2:
      return 2;
    case kInt4:
    case kFloat4:
      return 4;
    case kInt8:
    case kFloat8:
      return 8;
    default:
      return 0;
  }
}

}  // namespace

Rows::Rows(pg_result* result) : result_(result) {}

Rows::Rows(Rows&& other) noexcept
    : result_(std::exchange(other.result_, nullptr)),
      row_(other.row_),
      row_status_(std::move(other.row_status_)) {}

Rows& Rows::operator=(Rows&& other) noexcept {
  std::swap(result_, other.result_);
  std::swap(row_, other.row_);
  std::swap(row_status_, other.row_status_);
  return *this;
}

Rows::~Rows() { PQclear(result_); }

int64_t Rows::size() const { return PQntuples(result_); }

int64_t Rows::changed_rows() const {
  int64_t changed = 0;
  // Empty for statements that change no rows.
  return absl::SimpleAtoi(PQcmdTuples(result_), &changed) ? changed : 0;
}

bool Rows::Next() { return ++row_ < PQntuples(result_); }

bool Rows::IsNull(int column) const { return PQgetisnull(result_, row_, column) != 0; }

std::optional<absl::string_view> Rows::Read(int column, absl::Span<const uint32_t> types) {
  const uint32_t found = PQftype(result_, column);
  const bool has_type = std::find(types.begin(), types.end(), found) != types.end();
  const int size = PQgetlength(result_, row_, column);
  if (has_type && !IsNull(column) && (SizeOf(found) == 0 || SizeOf(found) == size)) {
    return absl::string_view(PQgetvalue(result_, row_, column), static_cast<size_t>(size));
  }
  if (row_status_.ok()) {
    const char* const name = PQfname(result_, column);
    row_status_ = absl::DataLossError(absl::StrCat(
        "column ", name == nullptr ? absl::StrCat(column) : name, " holds ",
        has_type && IsNull(column) ? "NULL" : TypeName(found), ", not ", TypeName(types.front())));
  }
  return std::nullopt;
}

bool Rows::Bool(int column) {
  const auto bytes = Read(column, {kBool});
  return bytes && LoadBigEndian<int8_t>(bytes->data()) != 0;
}

int64_t Rows::Int64(int column) {
  const auto bytes = Read(column, {kInt8, kInt4, kInt2});
  if (!bytes) return 0;
  switch (bytes->size()) {
    case 2:
      return LoadBigEndian<int16_t>(bytes->data());
    case 4:
      return LoadBigEndian<int32_t>(bytes->data());
    default:
      return LoadBigEndian<int64_t>(bytes->data());
  }
}

double Rows::Double(int column) {
  const auto bytes = Read(column, {kFloat8, kFloat4});
  if (!bytes) return 0;
  return bytes->size() == 4 ? std::bit_cast<float>(LoadBigEndian<int32_t>(bytes->data()))
                            : std::bit_cast<double>(LoadBigEndian<int64_t>(bytes->data()));
}

absl::string_view Rows::Text(int column) {
  return Read(column, {kText, kVarchar, kBpchar, kName, kJson}).value_or(absl::string_view());
}

absl::string_view Rows::Blob(int column) {
  return Read(column, {kBytea}).value_or(absl::string_view());
}

std::optional<int64_t> Rows::OptionalInt64(int column) {
  if (IsNull(column)) return std::nullopt;
  return Int64(column);
}

std::optional<double> Rows::OptionalDouble(int column) {
  if (IsNull(column)) return std::nullopt;
  return Double(column);
}

}  // namespace hypermap::storage::postgres
