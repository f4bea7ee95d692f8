#include "storage/geopackage/schema.h"

#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/evidence_retention.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/layer_table.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/standard_tables.h"
#include "storage/geopackage/time_mark_table.h"

namespace hypermap::storage {
namespace {

constexpr char kCreateTables[] = R"sql(
CREATE TABLE hypermap_metadata (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  schema_version INTEGER NOT NULL,
  map_name TEXT NOT NULL,
  frame_id TEXT NOT NULL,
  created_at_ns INTEGER NOT NULL,
  request_id TEXT NOT NULL,
  revision INTEGER NOT NULL,
  next_object_id INTEGER NOT NULL,
  oldest_revision INTEGER NOT NULL DEFAULT 0,
  incarnation INTEGER NOT NULL DEFAULT 0,
  provisional INTEGER NOT NULL DEFAULT 0,
  writing INTEGER NOT NULL DEFAULT 0,
  foreign_writes INTEGER NOT NULL DEFAULT 0,
  schema_cookie INTEGER NOT NULL DEFAULT 0,
  write_ahead INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE hypermap_layers (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL,
  table_name TEXT NOT NULL UNIQUE COLLATE NOCASE,
  frame_id TEXT NOT NULL,
  origin_x DOUBLE,
  origin_y DOUBLE,
  origin_yaw DOUBLE,
  resolution_m DOUBLE,
  row_begin INTEGER,
  row_end INTEGER,
  col_begin INTEGER,
  col_end INTEGER,
  parameters TEXT NOT NULL,
  lineage INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE hypermap_frames (
  id INTEGER PRIMARY KEY,
  child_frame_id TEXT NOT NULL UNIQUE,
  parent_frame_id TEXT NOT NULL,
  x DOUBLE NOT NULL,
  y DOUBLE NOT NULL,
  yaw DOUBLE NOT NULL
);
CREATE TABLE hypermap_revisions (
  revision INTEGER PRIMARY KEY,
  time_ns INTEGER NOT NULL,
  author TEXT NOT NULL,
  num_changes INTEGER NOT NULL
);
)sql";

// The tables and columns that the code reads and writes. A statement that names a missing one would
// fail anyway, but perhaps only after others have changed something.
struct TableColumns {
  const char* table;
  const char* columns;
};
constexpr TableColumns kTables[] = {
    {"hypermap_metadata",
     "id, schema_version, map_name, frame_id, created_at_ns, request_id, revision, next_object_id, "
     "oldest_revision, incarnation, provisional, writing, foreign_writes, schema_cookie, "
     "write_ahead"},
    {"hypermap_layers",
     "id, name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw, resolution_m, "
     "row_begin, row_end, col_begin, col_end, parameters, lineage"},
    {"hypermap_frames", "id, child_frame_id, parent_frame_id, x, y, yaw"},
    {"hypermap_revisions", "revision, time_ns, author, num_changes"},
    {"hypermap_receipts", "id, request_id, revision, time_ns, object_ids, digest"},
    {"hypermap_lineages",
     "id, name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw, resolution_m, "
     "first_revision, end_revision"},
    {"hypermap_layer_history",
     "lineage, first_revision, row_begin, row_end, col_begin, col_end, parameters"},
    {"hypermap_layer_revisions", "lineage, revision"},
    {"hypermap_frame_history", "child_frame_id, first_revision, parent_frame_id, x, y, yaw"},
    {"hypermap_object_history",
     "id, lineage, object_id, first_revision, end_revision, geom, label, existence, classes, tags, "
     "attributes, height_min, height_max, expires_at_ns"},
    {"hypermap_object_boxes",
     "id, min_x, max_x, min_y, max_y, first_revision, last_revision, min_lineage, max_lineage"},
    {"hypermap_tile_history", "id, lineage, tile_column, tile_row, end_revision, tile_data"},
    {"hypermap_changes",
     "revision, number, kind, lineage, object_id, tile_column, tile_row, detail"},
    {"hypermap_time_marks",
     "id, revision, commit_time_ns, passed_ns, lived_ns, server_time_ns, boot_id, since_boot_ns"},
    {"hypermap_fusion", "id, layer, strategy, parameters, exploration_layer"},
    {"hypermap_observations",
     "id, layer, stamp_ns, robot, sequence, content_hash, retracted, received_at_ns, body_size, "
     "body"},
    {"hypermap_operator_facts", "id, layer, stamp_ns, robot, sequence, number, kind, track, body"},
    {"hypermap_fusion_tracks", "id, layer, track, object_id"},
    {"hypermap_fusion_checkpoints",
     "id, layer, stamp_ns, robot, sequence, number, state_size, state, stored_at_ns"},
    {"hypermap_fusion_bases",
     "id, layer, stamp_ns, robot, sequence, number, num_facts, state_size, state"},
    {"hypermap_forgotten_sequences", "id, layer, robot, first_sequence, last_sequence"},
    {"gpkg_contents",
     "table_name, data_type, identifier, description, last_change, min_x, min_y, max_x, max_y, "
     "srs_id"},
    {"gpkg_extensions", "table_name, column_name, extension_name, definition, scope"},
    {"gpkg_geometry_columns", "table_name, column_name, geometry_type_name, srs_id, z, m"},
    {"gpkg_tile_matrix_set", "table_name, srs_id, min_x, min_y, max_x, max_y"},
    {"gpkg_tile_matrix",
     "table_name, zoom_level, matrix_width, matrix_height, tile_width, tile_height, pixel_x_size, "
     "pixel_y_size"},
    {"gpkg_2d_gridded_coverage_ancillary",
     "tile_matrix_set_name, datatype, scale, offset, precision, data_null, grid_cell_encoding, "
     "uom, field_name, quantity_definition"},
    {"gpkg_2d_gridded_tile_ancillary", "tpudt_name, tpudt_id, scale, offset"},
};

// GeoPackage requires every table that is not its own to be registered as an extension; programs
// that only read layers need not know ours. hypermap_layers is listed as a table of attributes as
// well: that shows people the layers' frames and origins, and keeps GDAL from listing all tables,
// as it does for a file without any. Its identifier can't be the name of a layer, because it has
// blanks.
constexpr char kRegisterTables[] = R"sql(
INSERT INTO gpkg_extensions
  SELECT name, NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only'
    FROM sqlite_master WHERE type = 'table' AND name LIKE 'hypermap\_%' ESCAPE '\';
INSERT INTO gpkg_contents (table_name, data_type, identifier, description)
  VALUES ('hypermap_layers', 'attributes', 'layers of the map',
          'kind, frame and origin of each layer');
)sql";

absl::StatusOr<bool> HasTable(Database* database, const char* table) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> found,
      database->QueryInt64("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?", table));
  return found.has_value();
}

const Migration* FindStep(absl::Span<const Migration> migrations, int64_t from_version) {
  for (const Migration& migration : migrations) {
    if (migration.from_version == from_version) return &migration;
  }
  return nullptr;
}

}  // namespace

absl::Status CreateSchema(Database* database, const MapHeader& header) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database));
  HYPERMAP_RETURN_IF_ERROR(CreateStandardTables(database));
  HYPERMAP_RETURN_IF_ERROR(database->Execute(
      absl::StrCat(kCreateTables, kCreateReceipts, kCreateFusionTables, kCreateRetentionTables,
                   kCreateHistoryTables, kCreateTimeMarks, kRegisterTables)));
  MapMetadata metadata;
  metadata.header = header;
  HYPERMAP_RETURN_IF_ERROR(InsertMetadata(database, kSchemaVersion, metadata));
  HYPERMAP_RETURN_IF_ERROR(SetContents(database, kLayersTable, Box(), header.created_at));
  HYPERMAP_RETURN_IF_ERROR(WatchForForeignWrites(database, kContentsTable));
  HYPERMAP_RETURN_IF_ERROR(RecordSchema(database));
  return transaction.Commit();
}

absl::StatusOr<int64_t> ReadSchemaVersion(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> application_id,
                            database->QueryInt64("PRAGMA application_id"));
  if (application_id != kGeoPackageApplicationId) {
    return absl::FailedPreconditionError("not a GeoPackage");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_map, HasTable(database, "hypermap_metadata"));
  if (!is_map) return absl::FailedPreconditionError("a GeoPackage, but not a map of Hypermap");
  absl::StatusOr<std::optional<int64_t>> version =
      database->QueryInt64("SELECT schema_version FROM hypermap_metadata WHERE id = 1");
  if (version.status().code() == absl::StatusCode::kInternal || (version.ok() && !*version)) {
    return absl::DataLossError("hypermap_metadata does not tell the schema version");
  }
  HYPERMAP_RETURN_IF_ERROR(version.status());
  return **version;
}

absl::Status CheckIsNotNewer(int64_t version, int64_t newest) {
  if (version <= newest) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("schema version ", version, " is newer than this program's ", newest));
}

absl::Status CheckIsOfThisVersion(int64_t version) {
  HYPERMAP_RETURN_IF_ERROR(CheckIsNotNewer(version, kSchemaVersion));
  if (version == kSchemaVersion) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("schema version ", version, " is older than this program's ", kSchemaVersion,
                   "; a server migrates the file when it opens it"));
}

absl::Status MigrateSchema(Database* database, int64_t newest,
                           absl::Span<const Migration> migrations) {
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t version, ReadSchemaVersion(database));
  if (version == newest) return absl::OkStatus();
  HYPERMAP_RETURN_IF_ERROR(CheckIsNotNewer(version, newest));
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database));
  for (int64_t from = version; from < newest; ++from) {
    const Migration* step = FindStep(migrations, from);
    if (step == nullptr) {
      return absl::FailedPreconditionError(
          absl::StrCat("no way to bring schema version ", from, " to ", newest));
    }
    HYPERMAP_RETURN_IF_ERROR(step->apply(database));
  }
  HYPERMAP_RETURN_IF_ERROR(
      database->Run("UPDATE hypermap_metadata SET schema_version = ? WHERE id = 1", newest));
  return transaction.Commit();
}

absl::Status VerifySchema(Database* database) {
  for (const auto& [table, columns] : kTables) {
    absl::StatusOr<Statement> select =
        database->Prepare(absl::StrCat("SELECT ", columns, " FROM ", table, " LIMIT 0"));
    if (select.ok()) continue;
    if (select.status().code() != absl::StatusCode::kInternal) return select.status();
    return absl::DataLossError(absl::StrCat("table ", table, ": ", select.status().message()));
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
