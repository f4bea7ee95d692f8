#include "map/layers/scalar_layer.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"

namespace hypermap {
namespace {

// Returns the nearest 32-bit float; infinity, which no cell holds, for values beyond the largest.
float Narrow(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (std::abs(value) <= kLargest) return static_cast<float>(value);
  return std::copysign(std::numeric_limits<float>::infinity(),
                       static_cast<float>(value > 0) - 0.5f);
}

}  // namespace

absl::StatusOr<CellCode> ScalarDomain::Encode(double value) const {
  const float code = Narrow(value);
  if (std::isfinite(code)) return code;
  return absl::InvalidArgumentError(absl::StrCat("value ", value, " is no finite 32-bit float"));
}

std::optional<CodePredicate> ScalarDomain::Match(const ValueQuery& query) const {
  if (const auto* keyword = std::get_if<ValueKeyword>(&query)) {
    if (*keyword == ValueKeyword::kUnknown) return IsUnknown;
    return std::nullopt;
  }
  const auto* asked = std::get_if<ValueRange>(&query);
  if (!asked) return std::nullopt;
  ValueRange range = *asked;
  range.low = Narrow(range.low);
  range.high = Narrow(range.high);
  return [range](CellCode code) { return !IsUnknown(code) && range.Contains(code); };
}

}  // namespace hypermap
