#include "storage/interchange/number_text.h"

#include <array>
#include <charconv>
#include <cmath>

#include "absl/strings/numbers.h"

namespace hypermap::storage {

std::string FormatNumber(double value) {
  std::array<char, 32> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return std::string(buffer.data(), result.ptr);
}

std::optional<double> ParseNumber(absl::string_view text) {
  // SimpleAtod would take hexadecimal, too.
  if (text.find_first_of("xX") != absl::string_view::npos) return std::nullopt;
  double value = 0.0;
  if (!absl::SimpleAtod(text, &value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace hypermap::storage
