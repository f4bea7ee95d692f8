#include "storage/encoding/layer_columns.h"

#include <algorithm>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"

namespace hypermap::storage {
namespace {

using Json = nlohmann::json;

// A bound that is out of range stays out of range: the box is checked against kAllCells afterwards.
int32_t CellBound(std::optional<int64_t> value) {
  return static_cast<int32_t>(
      std::clamp<int64_t>(value.value_or(0), -kMaxCellIndex - 1, kMaxCellIndex + 1));
}

CellBox DecodeExtent(const ExtentColumns& columns) {
  return {CellBound(columns.row_begin), CellBound(columns.row_end), CellBound(columns.col_begin),
          CellBound(columns.col_end)};
}

absl::StatusOr<GridGeometry> DecodeGrid(const LayerColumns& columns) {
  if (!columns.origin_x || !columns.origin_y || !columns.origin_yaw) {
    return absl::DataLossError("a grid without an origin");
  }
  return GridGeometry{PlanarTransform(*columns.origin_x, *columns.origin_y, *columns.origin_yaw),
                      *columns.resolution_m};
}

std::vector<std::string> EncodeShapeKinds(const ShapeKinds& kinds) {
  std::vector<std::string> names;
  for (const ShapeKind kind : kAllShapeKinds) {
    if (kinds.Contains(kind)) names.emplace_back(ShapeKindName(kind));
  }
  return names;
}

absl::StatusOr<ShapeKinds> DecodeShapeKinds(const std::vector<std::string>& names) {
  // Braces alone would make the set of all kinds.
  ShapeKinds kinds(std::initializer_list<ShapeKind>{});
  for (const std::string& name : names) {
    const std::optional<ShapeKind> kind = ParseShapeKind(name);
    if (!kind) return absl::DataLossError(absl::StrCat("shape_kinds: ", name));
    kinds.Add(*kind);
  }
  return kinds;
}

}  // namespace

ExtentColumns EncodeExtent(const CellBox& extent) {
  if (extent.empty()) return {};
  return {extent.row_begin, extent.row_end, extent.col_begin, extent.col_end};
}

absl::StatusOr<LayerColumns> EncodeLayer(const LayerSpec& spec, const CellBox& extent) {
  LayerColumns columns;
  columns.name = spec.name;
  columns.kind = std::string(LayerKindName(spec.kind));
  columns.frame_id = spec.frame_id;
  if (spec.grid) {
    columns.origin_x = spec.grid->layer_from_grid.x();
    columns.origin_y = spec.grid->layer_from_grid.y();
    columns.origin_yaw = spec.grid->layer_from_grid.yaw();
    columns.resolution_m = spec.grid->resolution_m;
  }
  columns.extent = EncodeExtent(extent);
  HYPERMAP_ASSIGN_OR_RETURN(columns.parameters, EncodeLayerParameters(spec));
  return columns;
}

absl::StatusOr<DecodedLayer> DecodeLayer(const LayerColumns& columns) {
  DecodedLayer layer;
  layer.spec.name = columns.name;
  layer.spec.frame_id = columns.frame_id;
  const std::optional<LayerKind> kind = ParseLayerKind(columns.kind);
  if (!kind) return absl::DataLossError(absl::StrCat("unknown kind ", columns.kind));
  layer.spec.kind = *kind;
  if (columns.resolution_m) {
    HYPERMAP_ASSIGN_OR_RETURN(layer.spec.grid, DecodeGrid(columns));
  }
  HYPERMAP_RETURN_IF_ERROR(DecodeLayerParameters(columns.parameters, &layer.spec));
  HYPERMAP_RETURN_IF_ERROR(Validate(layer.spec));
  layer.extent = DecodeExtent(columns.extent);
  if (!layer.extent.empty() && !(IsGridKind(*kind) && kAllCells.Contains(layer.extent))) {
    return absl::DataLossError("the extent is not one that a layer can have");
  }
  return layer;
}

absl::StatusOr<std::string> EncodeLayerParameters(const LayerSpec& spec) {
  try {
    Json json{{"free_below", spec.thresholds.free_below},
              {"occupied_above", spec.thresholds.occupied_above},
              {"unit", spec.unit}};
    if (!spec.aliases.empty()) json["aliases"] = spec.aliases;
    if (spec.explored_rule != CellRule::kCentre) {
      json["explored_rule"] = CellRuleName(spec.explored_rule);
    }
    if (!spec.shape_kinds.ContainsAll()) json["shape_kinds"] = EncodeShapeKinds(spec.shape_kinds);
    return json.dump();
  } catch (const Json::exception&) {
    return absl::InvalidArgumentError("layer.unit or an alias is not UTF-8");
  }
}

absl::Status DecodeLayerParameters(absl::string_view text, LayerSpec* spec) {
  try {
    const Json json = Json::parse(text.begin(), text.end());
    spec->thresholds.free_below = json.value("free_below", spec->thresholds.free_below);
    spec->thresholds.occupied_above = json.value("occupied_above", spec->thresholds.occupied_above);
    spec->unit = json.value("unit", spec->unit);
    spec->aliases = json.value("aliases", spec->aliases);
    const std::string rule = json.value("explored_rule", "centre");
    const std::optional<CellRule> explored_rule = ParseCellRule(rule);
    if (!explored_rule) return absl::DataLossError(absl::StrCat("explored_rule ", rule));
    spec->explored_rule = *explored_rule;
    if (!json.contains("shape_kinds")) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(
        spec->shape_kinds, DecodeShapeKinds(json["shape_kinds"].get<std::vector<std::string>>()));
    return absl::OkStatus();
  } catch (const Json::exception& e) {
    return absl::DataLossError(absl::StrCat("column parameters: ", e.what()));
  }
}

}  // namespace hypermap::storage
