#include "map/layers/exploration_layer.h"

#include "absl/strings/str_cat.h"

namespace hypermap {

absl::StatusOr<CellCode> ExplorationDomain::Encode(double value) const {
  if (value == 0.0 || value == 1.0) return static_cast<CellCode>(value);
  return absl::InvalidArgumentError(
      absl::StrCat("value ", value, " is neither 0 (unexplored) nor 1 (explored)"));
}

std::optional<CodePredicate> ExplorationDomain::Match(const ValueQuery& query) const {
  const auto* keyword = std::get_if<ValueKeyword>(&query);
  if (!keyword) return std::nullopt;
  switch (*keyword) {
    case ValueKeyword::kExplored:
      return [](CellCode code) { return code == 1; };
    case ValueKeyword::kUnexplored:
      return [](CellCode code) { return code == 0; };
    case ValueKeyword::kUnknown:
      return IsUnknown;
    default:
      return std::nullopt;
  }
}

}  // namespace hypermap
