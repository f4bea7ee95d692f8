#include "storage/geopackage/contents.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "storage/encoding/geometry_blob.h"
#include "storage/geopackage/tile_matrix.h"

namespace hypermap::storage {
namespace {

absl::Status InsertContents(Database* database, const std::string& table,
                            absl::string_view data_type, const LayerSpec& spec) {
  const std::string description =
      absl::StrCat(LayerKindName(spec.kind), " layer, metres in frame ", spec.frame_id);
  return database->Run(
      "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, srs_id) "
      "VALUES (?, ?, ?, ?, ?)",
      table, data_type, spec.name, description, kUndefinedCartesianSrsId);
}

absl::Status InsertExtension(Database* database, const std::string& table, const char* column,
                             const char* extension, const char* definition, const char* scope) {
  return database->Run("INSERT INTO gpkg_extensions VALUES (?, ?, ?, ?, ?)", table, column,
                       extension, definition, scope);
}

}  // namespace

absl::string_view GeometryTypeName(const ShapeKinds& kinds) {
  if (kinds == ShapeKinds{ShapeKind::kPolygon}) return "POLYGON";
  if (kinds == ShapeKinds{ShapeKind::kLineString}) return "LINESTRING";
  if (kinds == ShapeKinds{ShapeKind::kPoint}) return "POINT";
  return "GEOMETRY";
}

absl::Status RegisterFeatures(Database* database, const std::string& table, const LayerSpec& spec) {
  HYPERMAP_RETURN_IF_ERROR(InsertContents(database, table, "features", spec));
  HYPERMAP_RETURN_IF_ERROR(
      database->Run("INSERT INTO gpkg_geometry_columns VALUES (?, ?, ?, ?, 0, 0)", table,
                    kGeometryColumn, GeometryTypeName(spec.shape_kinds), kUndefinedCartesianSrsId));
  return InsertExtension(database, table, kGeometryColumn, "gpkg_rtree_index",
                         "http://www.geopackage.org/spec130/#extension_rtree", "write-only");
}

absl::Status RegisterCoverage(Database* database, const std::string& table, const LayerSpec& spec,
                              const CoverageCoding& coding) {
  const Box matrix = TileMatrixBounds(*spec.grid);
  const double resolution_m = spec.grid->resolution_m;
  HYPERMAP_RETURN_IF_ERROR(InsertContents(database, table, "2d-gridded-coverage", spec));
  HYPERMAP_RETURN_IF_ERROR(database->Run(
      "INSERT INTO gpkg_tile_matrix_set VALUES (?, ?, ?, ?, ?, ?)", table, kUndefinedCartesianSrsId,
      matrix.min.x, matrix.min.y, matrix.max.x, matrix.max.y));
  HYPERMAP_RETURN_IF_ERROR(database->Run(
      "INSERT INTO gpkg_tile_matrix VALUES (?, ?, ?, ?, ?, ?, ?, ?)", table, kZoomLevel,
      kTileMatrixSide, kTileMatrixSide, kTileSide, kTileSide, resolution_m, resolution_m));
  HYPERMAP_RETURN_IF_ERROR(database->Run(
      "INSERT INTO gpkg_2d_gridded_coverage_ancillary (tile_matrix_set_name, datatype, scale, "
      "offset, precision, data_null, grid_cell_encoding, uom, field_name, quantity_definition) "
      "VALUES (?, ?, ?, 0.0, ?, ?, 'grid-value-is-area', ?, ?, ?)",
      table, coding.datatype, coding.scale, coding.precision, coding.data_null,
      spec.unit.empty() ? std::nullopt : std::make_optional(spec.unit), LayerKindName(spec.kind),
      coding.quantity));
  return InsertExtension(database, table, "tile_data", "gpkg_2d_gridded_coverage",
                         "http://docs.opengeospatial.org/is/17-066r1/17-066r1.html", "read-write");
}

absl::Status SetContents(Database* database, const std::string& table, const Box& extent,
                         absl::Time last_change) {
  const std::string time =
      absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ", last_change, absl::UTCTimeZone());
  const auto side = [&extent](double value) {
    return extent.empty() ? std::nullopt : std::make_optional(value);
  };
  return database->Run(
      "UPDATE gpkg_contents SET last_change = ?, min_x = ?, min_y = ?, max_x = ?, max_y = ? "
      "WHERE table_name = ?",
      time, side(extent.min.x), side(extent.min.y), side(extent.max.x), side(extent.max.y), table);
}

absl::Status Unregister(Database* database, const std::string& table) {
  // Tables that refer to others by foreign keys come first.
  for (const char* sql : {"DELETE FROM gpkg_2d_gridded_tile_ancillary WHERE tpudt_name = ?",
                          "DELETE FROM gpkg_2d_gridded_coverage_ancillary "
                          "WHERE tile_matrix_set_name = ?",
                          "DELETE FROM gpkg_tile_matrix WHERE table_name = ?",
                          "DELETE FROM gpkg_tile_matrix_set WHERE table_name = ?",
                          "DELETE FROM gpkg_geometry_columns WHERE table_name = ?",
                          "DELETE FROM gpkg_extensions WHERE table_name = ?",
                          "DELETE FROM gpkg_contents WHERE table_name = ?"}) {
    HYPERMAP_RETURN_IF_ERROR(database->Run(sql, table));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
