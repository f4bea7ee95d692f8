#include "storage/geopackage/layer_table.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/encoding/layer_columns.h"
#include "storage/geopackage/table_names.h"

namespace hypermap::storage {

absl::StatusOr<StoredLayer> ReadLayerRow(Statement* row) {
  LayerColumns columns;
  columns.name = std::string(row->Text(0));
  columns.kind = std::string(row->Text(1));
  std::string table(row->Text(2));
  columns.frame_id = std::string(row->Text(3));
  columns.origin_x = row->OptionalDouble(4);
  columns.origin_y = row->OptionalDouble(5);
  columns.origin_yaw = row->OptionalDouble(6);
  columns.resolution_m = row->OptionalDouble(7);
  columns.extent = {row->OptionalInt64(8), row->OptionalInt64(9), row->OptionalInt64(10),
                    row->OptionalInt64(11)};
  columns.parameters = std::string(row->Text(12));
  const int64_t lineage = row->Int64(13);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  HYPERMAP_ASSIGN_OR_RETURN(DecodedLayer layer, DecodeLayer(columns));
  if (!IsLayerTableName(table)) {
    return absl::DataLossError(absl::StrCat("table_name ", table, " is not for layers"));
  }
  return StoredLayer{std::move(layer.spec), std::move(table), layer.extent, lineage};
}

absl::Status InsertLayer(Database* database, const StoredLayer& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerColumns columns, EncodeLayer(layer.spec, layer.extent));
  const ExtentColumns& extent = columns.extent;
  return database->Run(
      "INSERT INTO hypermap_layers (name, kind, table_name, frame_id, origin_x, origin_y, "
      "origin_yaw, resolution_m, parameters, row_begin, row_end, col_begin, col_end) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      columns.name, columns.kind, layer.table, columns.frame_id, columns.origin_x, columns.origin_y,
      columns.origin_yaw, columns.resolution_m, columns.parameters, extent.row_begin,
      extent.row_end, extent.col_begin, extent.col_end);
}

absl::Status UpdateLayerExtent(Database* database, const std::string& layer,
                               const CellBox& extent) {
  const ExtentColumns columns = EncodeExtent(extent);
  return database->Run(
      "UPDATE hypermap_layers SET row_begin = ?, row_end = ?, col_begin = ?, col_end = ? "
      "WHERE name = ?",
      columns.row_begin, columns.row_end, columns.col_begin, columns.col_end, layer);
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
