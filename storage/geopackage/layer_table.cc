#include "storage/geopackage/layer_table.h"

#include <algorithm>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/geopackage/table_names.h"

namespace hypermap::storage {
namespace {

using Json = nlohmann::json;

// A bound that is out of range stays out of range: the box is checked against kAllCells afterwards.
int32_t CellBound(std::optional<int64_t> value) {
  return static_cast<int32_t>(
      std::clamp<int64_t>(value.value_or(0), -kMaxCellIndex - 1, kMaxCellIndex + 1));
}

absl::Status CheckLayer(const StoredLayer& layer) {
  HYPERMAP_RETURN_IF_ERROR(Validate(layer.spec));
  if (!IsLayerTableName(layer.table)) {
    return absl::DataLossError(absl::StrCat("table_name ", layer.table, " is not for layers"));
  }
  if (!layer.extent.empty() && !(IsGridKind(layer.spec.kind) && kAllCells.Contains(layer.extent))) {
    return absl::DataLossError("the extent is not one that a layer can have");
  }
  return absl::OkStatus();
}

std::optional<int64_t> BoundOrNull(const CellBox& extent, int32_t bound) {
  return extent.empty() ? std::nullopt : std::make_optional(int64_t{bound});
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

absl::StatusOr<StoredLayer> ReadLayerRow(Statement* row) {
  StoredLayer layer;
  layer.spec.name = std::string(row->Text(0));
  const std::optional<LayerKind> kind = ParseLayerKind(row->Text(1));
  layer.table = std::string(row->Text(2));
  layer.spec.frame_id = std::string(row->Text(3));
  if (!row->IsNull(7)) {
    const double x = row->Double(4);
    const double y = row->Double(5);
    const double yaw = row->Double(6);
    layer.spec.grid = GridGeometry{PlanarTransform(x, y, yaw), row->Double(7)};
  }
  layer.extent = {CellBound(row->OptionalInt64(8)), CellBound(row->OptionalInt64(9)),
                  CellBound(row->OptionalInt64(10)), CellBound(row->OptionalInt64(11))};
  const absl::string_view parameters = row->Text(12);
  layer.lineage = row->Int64(13);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  if (!kind) return absl::DataLossError(absl::StrCat("unknown kind ", row->Text(1)));
  layer.spec.kind = *kind;
  HYPERMAP_RETURN_IF_ERROR(DecodeLayerParameters(parameters, &layer.spec));
  HYPERMAP_RETURN_IF_ERROR(CheckLayer(layer));
  return layer;
}

absl::Status InsertLayer(Database* database, const StoredLayer& layer) {
  const LayerSpec& spec = layer.spec;
  HYPERMAP_ASSIGN_OR_RETURN(const std::string parameters, EncodeLayerParameters(spec));
  std::optional<double> x, y, yaw, resolution_m;
  if (spec.grid) {
    x = spec.grid->layer_from_grid.x();
    y = spec.grid->layer_from_grid.y();
    yaw = spec.grid->layer_from_grid.yaw();
    resolution_m = spec.grid->resolution_m;
  }
  HYPERMAP_RETURN_IF_ERROR(database->Run(
      "INSERT INTO hypermap_layers (name, kind, table_name, frame_id, origin_x, origin_y, "
      "origin_yaw, resolution_m, parameters) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
      spec.name, LayerKindName(spec.kind), layer.table, spec.frame_id, x, y, yaw, resolution_m,
      parameters));
  return UpdateLayerExtent(database, spec.name, layer.extent);
}

absl::Status UpdateLayerExtent(Database* database, const std::string& layer,
                               const CellBox& extent) {
  return database->Run(
      "UPDATE hypermap_layers SET row_begin = ?, row_end = ?, col_begin = ?, col_end = ? "
      "WHERE name = ?",
      BoundOrNull(extent, extent.row_begin), BoundOrNull(extent, extent.row_end),
      BoundOrNull(extent, extent.col_begin), BoundOrNull(extent, extent.col_end), layer);
}

absl::Status UpdateLayerParameters(Database* database, const LayerSpec& spec) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string parameters, EncodeLayerParameters(spec));
  return database->Run("UPDATE hypermap_layers SET parameters = ? WHERE name = ?", parameters,
                       spec.name);
}

absl::Status RemoveLayer(Database* database, const std::string& layer) {
  return database->Run("DELETE FROM hypermap_layers WHERE name = ?", layer);
}

absl::StatusOr<std::vector<StoredLayer>> ReadLayers(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                            database->Prepare(absl::StrCat("SELECT ", kLayerColumns,
                                                           " FROM hypermap_layers ORDER BY name")));
  std::vector<StoredLayer> layers;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return layers;
    absl::StatusOr<StoredLayer> layer = ReadLayerRow(&select);
    if (!layer.ok()) {
      return absl::DataLossError(
          absl::StrCat("hypermap_layers, layer ", select.Text(0), ": ", layer.status().message()));
    }
    layers.push_back(*std::move(layer));
  }
}

}  // namespace hypermap::storage
