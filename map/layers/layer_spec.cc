#include "map/layers/layer_spec.h"

#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap {
namespace {

constexpr size_t kMaxUnitLength = 63;
constexpr double kMinResolution = 1e-4;
constexpr double kMaxResolution = 1e4;

constexpr std::array<std::pair<LayerKind, const char*>, 4> kKindNames{{
    {LayerKind::kOccupancy, "occupancy"},
    {LayerKind::kExploration, "exploration"},
    {LayerKind::kSemantic, "semantic"},
    {LayerKind::kScalar, "scalar"},
}};

constexpr std::array<std::pair<CellRule, const char*>, 3> kRuleNames{{
    {CellRule::kCentre, "centre"},
    {CellRule::kCovered, "covered"},
    {CellRule::kTouched, "touched"},
}};

absl::Status ValidateIdentifier(absl::string_view field, absl::string_view name,
                                absl::string_view also_allowed) {
  if (name.empty()) return absl::InvalidArgumentError(absl::StrCat(field, " is empty"));
  if (name.size() > kMaxNameLength) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " is longer than ", kMaxNameLength, " characters"));
  }
  if (!absl::ascii_isalnum(name.front())) {
    return absl::InvalidArgumentError(absl::StrCat(field, " must begin with a letter or a digit"));
  }
  for (const char c : name) {
    if (!absl::ascii_isalnum(c) && also_allowed.find(c) == absl::string_view::npos) {
      return absl::InvalidArgumentError(
          absl::StrCat(field, " may hold letters, digits and '", also_allowed, "', nothing else"));
    }
  }
  return absl::OkStatus();
}

absl::Status ValidateGrid(const LayerSpec& spec) {
  if (spec.kind == LayerKind::kSemantic) {
    if (spec.grid) return absl::InvalidArgumentError("layer.grid: a semantic layer has no cells");
    return absl::OkStatus();
  }
  if (!spec.grid) {
    return absl::InvalidArgumentError(
        absl::StrCat("layer.grid is required for the kind ", LayerKindName(spec.kind)));
  }
  const PlanarTransform& origin = spec.grid->layer_from_grid;
  if (!std::isfinite(origin.x()) || !std::isfinite(origin.y()) || !std::isfinite(origin.yaw())) {
    return absl::InvalidArgumentError("layer.grid.origin is not finite");
  }
  const double resolution_m = spec.grid->resolution_m;
  if (!(resolution_m >= kMinResolution && resolution_m <= kMaxResolution)) {
    return absl::InvalidArgumentError(absl::StrCat("layer.grid.resolution_m must be in [",
                                                   kMinResolution, ", ", kMaxResolution, "]"));
  }
  return absl::OkStatus();
}

absl::Status ValidateThresholds(const OccupancyThresholds& t) {
  if (!(t.free_below >= 0.0 && t.free_below <= 1.0)) {
    return absl::InvalidArgumentError("layer.thresholds.free_below must be in [0, 1]");
  }
  if (!(t.occupied_above >= t.free_below && t.occupied_above <= 1.0)) {
    return absl::InvalidArgumentError("layer.thresholds.occupied_above must be in [free_below, 1]");
  }
  return absl::OkStatus();
}

absl::Status ValidateAliases(const LayerSpec& spec) {
  if (!spec.aliases.empty() && spec.kind != LayerKind::kSemantic) {
    return absl::InvalidArgumentError(
        absl::StrCat("layer.aliases: the kind ", LayerKindName(spec.kind), " has no labels"));
  }
  const absl::Status status = Validate(spec.aliases);
  return absl::Status(status.code(), absl::StrCat("layer.", status.message()));
}

}  // namespace

absl::string_view CellRuleName(CellRule rule) {
  for (const auto& [known, name] : kRuleNames) {
    if (known == rule) return name;
  }
  return "";
}

std::optional<CellRule> ParseCellRule(absl::string_view name) {
  for (const auto& [rule, known] : kRuleNames) {
    if (known == name) return rule;
  }
  return std::nullopt;
}

absl::string_view LayerKindName(LayerKind kind) {
  for (const auto& [known, name] : kKindNames) {
    if (known == kind) return name;
  }
  return "unknown";
}

std::optional<LayerKind> ParseLayerKind(absl::string_view name) {
  for (const auto& [kind, known] : kKindNames) {
    if (name == known) return kind;
  }
  return std::nullopt;
}

absl::Status ValidateName(absl::string_view field, absl::string_view name) {
  return ValidateIdentifier(field, name, "_-.");
}

absl::Status ValidateFrameId(absl::string_view field, absl::string_view frame_id) {
  return ValidateIdentifier(field, frame_id, "_-./");
}

absl::Status Validate(const LayerSpec& spec) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("layer.name", spec.name));
  HYPERMAP_RETURN_IF_ERROR(ValidateFrameId("layer.frame_id", spec.frame_id));
  HYPERMAP_RETURN_IF_ERROR(ValidateGrid(spec));
  HYPERMAP_RETURN_IF_ERROR(ValidateThresholds(spec.thresholds));
  if (spec.unit.size() > kMaxUnitLength) {
    return absl::InvalidArgumentError(
        absl::StrCat("layer.unit is longer than ", kMaxUnitLength, " bytes"));
  }
  if (spec.shape_kinds.empty()) {
    return absl::InvalidArgumentError("layer.shape_kinds: a layer of objects takes at least one");
  }
  if (spec.kind != LayerKind::kSemantic && !spec.shape_kinds.ContainsAll()) {
    return absl::InvalidArgumentError(
        absl::StrCat("layer.shape_kinds: the kind ", LayerKindName(spec.kind), " has no shapes"));
  }
  return ValidateAliases(spec);
}

}  // namespace hypermap
