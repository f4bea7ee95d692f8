#include "map/layers/occupancy_layer.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace hypermap {

absl::StatusOr<CellCode> OccupancyDomain::Encode(double value) const {
  if (!(value >= 0.0 && value <= 1.0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("value ", value, " is no probability in [0, 1]"));
  }
  return static_cast<CellCode>(std::round(value * kStepsPerUnit));
}

std::optional<CodePredicate> OccupancyDomain::Match(const ValueQuery& query) const {
  if (const auto* range = std::get_if<ValueRange>(&query)) {
    return [range = *range](CellCode code) {
      return !IsUnknown(code) && range.Contains(code / kStepsPerUnit);
    };
  }
  const auto* keyword = std::get_if<ValueKeyword>(&query);
  if (!keyword) return std::nullopt;
  switch (*keyword) {
    case ValueKeyword::kFree:
      return [limit = thresholds_.free_below](CellCode code) {
        return !IsUnknown(code) && code / kStepsPerUnit < limit;
      };
    case ValueKeyword::kOccupied:
      return [limit = thresholds_.occupied_above](CellCode code) {
        return !IsUnknown(code) && code / kStepsPerUnit > limit;
      };
    case ValueKeyword::kUnknown:
      return IsUnknown;
    default:
      return std::nullopt;
  }
}

}  // namespace hypermap
