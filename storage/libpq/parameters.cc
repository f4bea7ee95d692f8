#include "storage/libpq/parameters.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "base/text/utf8.h"
#include "storage/libpq/wire.h"

namespace hypermap::storage::postgres {
namespace {

// A value is sent as its length and its bytes; NULL as the length -1.
void AppendElement(int64_t value, std::string* out) {
  AppendBigEndian(int32_t{8}, out);
  AppendBigEndian(value, out);
}

void AppendElement(double value, std::string* out) {
  AppendElement(std::bit_cast<int64_t>(value), out);
}

void AppendElement(absl::string_view text, std::string* out) {
  AppendBigEndian(static_cast<int32_t>(text.size()), out);
  out->append(text.data(), text.size());
}

void AppendElement(const BlobView& blob, std::string* out) { AppendElement(blob.bytes, out); }

template <typename T>
void AppendElement(const std::optional<T>& value, std::string* out) {
  if (value) {
    AppendElement(*value, out);
  } else {
    AppendBigEndian(int32_t{-1}, out);
  }
}

template <typename T>
bool IsNull(const T&) {
  return false;
}

template <typename T>
bool IsNull(const std::optional<T>& value) {
  return !value.has_value();
}

}  // namespace

void Parameters::Add(bool value) {
  values_.push_back({kBool, false, std::string(1, static_cast<char>(value))});
}

void Parameters::Add(int64_t value) {
  Value& added = values_.emplace_back(Value{kInt8});
  AppendBigEndian(value, &added.bytes);
}

void Parameters::Add(double value) {
  Value& added = values_.emplace_back(Value{kFloat8});
  AppendBigEndian(std::bit_cast<int64_t>(value), &added.bytes);
}

void Parameters::Add(absl::string_view text) {
  values_.push_back({kText, false, std::string(text)});
  CheckText(text);
}

void Parameters::Add(const BlobView& blob) {
  values_.push_back({kBytea, false, std::string(blob.bytes)});
}

// array_recv of PostgreSQL reads: the number of dimensions, whether there are NULLs, the type of
// the elements, and for each dimension its size and the index of its first element.
template <typename T>
void Parameters::AddArray(uint32_t type, uint32_t element_type, absl::Span<const T> values) {
  std::string& bytes = values_.emplace_back(Value{type}).bytes;
  const bool has_null =
      std::any_of(values.begin(), values.end(), [](const T& v) { return IsNull(v); });
  AppendBigEndian(static_cast<int32_t>(values.empty() ? 0 : 1), &bytes);
  AppendBigEndian(static_cast<int32_t>(has_null), &bytes);
  AppendBigEndian(element_type, &bytes);
  if (values.empty()) return;
  AppendBigEndian(static_cast<int32_t>(values.size()), &bytes);
  AppendBigEndian(int32_t{1}, &bytes);
  for (const T& value : values) AppendElement(value, &bytes);
}

void Parameters::Add(absl::Span<const int64_t> values) { AddArray(kInt8Array, kInt8, values); }

void Parameters::Add(absl::Span<const double> values) { AddArray(kFloat8Array, kFloat8, values); }

void Parameters::Add(absl::Span<const absl::string_view> values) {
  AddArray(kTextArray, kText, values);
  for (const absl::string_view text : values) CheckText(text);
}

void Parameters::Add(absl::Span<const BlobView> values) { AddArray(kByteaArray, kBytea, values); }

void Parameters::Add(absl::Span<const std::optional<int64_t>> values) {
  AddArray(kInt8Array, kInt8, values);
}

void Parameters::Add(absl::Span<const std::optional<double>> values) {
  AddArray(kFloat8Array, kFloat8, values);
}

void Parameters::AddNull(bool) { values_.push_back({kBool, true}); }

void Parameters::AddNull(int64_t) { values_.push_back({kInt8, true}); }

void Parameters::AddNull(double) { values_.push_back({kFloat8, true}); }

void Parameters::AddNull(absl::string_view) { values_.push_back({kText, true}); }

void Parameters::AddNull(const BlobView&) { values_.push_back({kBytea, true}); }

void Parameters::CheckText(absl::string_view text) {
  if (!status_.ok()) return;
  const char* fault = nullptr;
  if (text.find('\0') != absl::string_view::npos) fault = "contains a NUL";
  if (!IsUtf8(text)) fault = "is not UTF-8";
  if (fault == nullptr) return;
  status_ = absl::InvalidArgumentError(absl::StrCat("the text $", values_.size(), " ", fault));
}

}  // namespace hypermap::storage::postgres
