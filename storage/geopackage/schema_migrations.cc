#include "storage/geopackage/schema_migrations.h"

#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/evidence_retention.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/fusion_tables.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/table_names.h"
#include "storage/geopackage/time_mark_table.h"

namespace hypermap::storage {
namespace {

constexpr char kRegisterNewTables[] = R"sql(
INSERT INTO gpkg_extensions
  SELECT name, NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only'
    FROM sqlite_master WHERE type = 'table' AND name LIKE 'hypermap\_%' ESCAPE '\'
      AND name NOT IN (SELECT table_name FROM gpkg_extensions WHERE table_name NOT NULL);
)sql";

// The tables of layers, in any schema version.
absl::StatusOr<std::vector<std::string>> LayerTables(Database* database,
                                                     const std::string& condition) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare(absl::StrCat("SELECT table_name FROM hypermap_layers ", condition)));
  std::vector<std::string> tables;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return tables;
    tables.emplace_back(select.Text(0));
    if (!IsLayerTableName(tables.back())) {
      return absl::DataLossError(
          absl::StrCat("hypermap_layers: table_name ", tables.back(), " is not for layers"));
    }
  }
}

absl::StatusOr<std::vector<std::string>> FeatureTables(Database* database) {
  return LayerTables(database, "WHERE kind = 'semantic'");
}

// Version 1 had no fused layers. It had no aliases either, but these need no columns.
absl::Status AddFusion(Database* database) {
  return database->Execute(absl::StrCat(kCreateFusionTables, kRegisterNewTables));
}

constexpr char kBeginHistory[] = R"sql(
ALTER TABLE hypermap_metadata ADD COLUMN oldest_revision INTEGER NOT NULL DEFAULT 0;
UPDATE hypermap_metadata SET oldest_revision = revision;
ALTER TABLE hypermap_layers ADD COLUMN lineage INTEGER NOT NULL DEFAULT 0;
INSERT INTO hypermap_lineages (name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw,
    resolution_m, first_revision)
  SELECT name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw, resolution_m, 0
    FROM hypermap_layers ORDER BY id;
UPDATE hypermap_layers SET lineage =
  (SELECT l.id FROM hypermap_lineages AS l WHERE l.name = hypermap_layers.name);
INSERT INTO hypermap_layer_history
  SELECT lineage, 0, row_begin, row_end, col_begin, col_end, parameters FROM hypermap_layers;
INSERT INTO hypermap_layer_revisions SELECT lineage, 0 FROM hypermap_layers;
INSERT INTO hypermap_frame_history
  SELECT child_frame_id, 0, parent_frame_id, x, y, yaw FROM hypermap_frames;
)sql";

// In version 2 a receipt had the time of its revision. The table is copied, because renaming it
// would make SQLite parse every trigger of the file, also those of other programs.
constexpr char kSaveReceipts[] = R"sql(
CREATE TEMP TABLE old_receipts AS
  SELECT c.id, c.request_id, c.revision, r.time_ns, c.object_ids
    FROM hypermap_receipts AS c JOIN hypermap_revisions AS r ON r.revision = c.revision;
DROP TABLE hypermap_receipts;
)sql";
constexpr char kRestoreReceipts[] = R"sql(
INSERT INTO hypermap_receipts (id, request_id, revision, time_ns, object_ids)
  SELECT * FROM old_receipts ORDER BY id;
DROP TABLE temp.old_receipts;
)sql";

// Version 2 had no history: the oldest revision that can be asked for is the one the map has.
absl::Status AddHistory(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> tables, FeatureTables(database));
  for (const std::string& table : tables) {
    HYPERMAP_RETURN_IF_ERROR(database->Execute(absl::StrCat(
        "ALTER TABLE \"", table, "\" ADD COLUMN version INTEGER NOT NULL DEFAULT 0; ALTER TABLE \"",
        table, "\" ADD COLUMN expires_at_ns INTEGER;")));
  }
  return database->Execute(absl::StrCat(kSaveReceipts, kCreateReceipts, kRestoreReceipts,
                                        kCreateHistoryTables, kBeginHistory, kRegisterNewTables));
}

// Allows this connection to change the text of the schema, until it is destroyed.
class WritableSchema {
 public:
  explicit WritableSchema(Database* database) : handle_(database->handle()) { Set(true); }
  ~WritableSchema() { Set(false); }
  WritableSchema(const WritableSchema&) = delete;
  WritableSchema& operator=(const WritableSchema&) = delete;

 private:
  void Set(bool writable) {
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, writable ? 0 : 1, nullptr);
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_WRITABLE_SCHEMA, writable ? 1 : 0, nullptr);
  }

  sqlite3* handle_;
};

// The column as version 3 declared it, and as GDAL declares it when it rebuilds a table.
constexpr char kDeclareAnyGeometry[] = R"sql(
UPDATE sqlite_master
  SET sql = replace(replace(sql, 'geom POLYGON NOT NULL', 'geom GEOMETRY NOT NULL'),
                    '"geom" POLYGON NOT NULL', '"geom" GEOMETRY NOT NULL')
  WHERE type = 'table' AND name = ? COLLATE NOCASE
)sql";
constexpr char kRegisterAnyGeometry[] = R"sql(
UPDATE gpkg_geometry_columns SET geometry_type_name = 'GEOMETRY'
  WHERE table_name = ? COLLATE NOCASE AND column_name = 'geom'
)sql";

// Version 3 had polygons only; its layers now take every kind of shape. Readers go by
// gpkg_geometry_columns, but the standard wants the declared type of the column to agree
// (requirement 31). SQLite can't alter that type. The text of the schema is changed instead of the
// table being rebuilt: both types have the same affinity, so that no row changes
// (https://www.sqlite.org/lang_altertable.html#otheralter).
absl::Status AllowEveryShape(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> tables, FeatureTables(database));
  const WritableSchema here(database);
  for (const std::string& table : tables) {
    HYPERMAP_RETURN_IF_ERROR(database->Run(kDeclareAnyGeometry, table));
    HYPERMAP_RETURN_IF_ERROR(database->Run(kRegisterAnyGeometry, table));
  }
  // Makes every connection, this one included, parse the schema anew at its next statement.
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> cookie,
                            database->QueryInt64("PRAGMA schema_version"));
  return database->Execute(absl::StrCat("PRAGMA schema_version = ", cookie.value_or(0) + 1));
}

// Up to version 4 the age of everything followed from the times of commits.
absl::Status AddTimeMarks(Database* database) {
  return database->Execute(absl::StrCat(kCreateTimeMarks, kRegisterNewTables));
}

constexpr char kDescribeMap[] = R"sql(
ALTER TABLE hypermap_metadata ADD COLUMN incarnation INTEGER NOT NULL DEFAULT 0;
ALTER TABLE hypermap_metadata ADD COLUMN provisional INTEGER NOT NULL DEFAULT 0;
)sql";

// Up to version 5 nothing told one history of a map from another, and a receipt did not tell to
// which request it belongs. The map gets its incarnation when it is opened.
absl::Status AddIncarnation(Database* database) {
  HYPERMAP_RETURN_IF_ERROR(database->Execute(kDescribeMap));
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> has_digest,
      database->QueryInt64(
          "SELECT 1 FROM pragma_table_info('hypermap_receipts') WHERE name = 'digest'"));
  // The step from version 2 makes the table as it is now.
  if (has_digest) return absl::OkStatus();
  return database->Execute("ALTER TABLE hypermap_receipts ADD COLUMN digest BLOB");
}

// All entries of a checkpoint had been received before the newest revision.
constexpr char kDateCheckpoints[] = R"sql(
ALTER TABLE hypermap_fusion_checkpoints ADD COLUMN stored_at_ns INTEGER NOT NULL DEFAULT 0;
UPDATE hypermap_fusion_checkpoints SET stored_at_ns =
  (SELECT coalesce(max(time_ns), 0) FROM hypermap_revisions);
)sql";

// Up to version 6 all evidence was kept.
absl::Status AddRetention(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> has_date,
      database->QueryInt64("SELECT 1 FROM pragma_table_info('hypermap_fusion_checkpoints') "
                           "WHERE name = 'stored_at_ns'"));
  // The step from version 1 makes the table as it is now.
  if (!has_date) HYPERMAP_RETURN_IF_ERROR(database->Execute(kDateCheckpoints));
  return database->Execute(absl::StrCat(kCreateRetentionTables, kRegisterNewTables));
}

// Up to version 7 pages had no checksums, so that nothing had to tell foreign writes from damage.
// The checksums come with the file that is written anew (map_file.cc).
absl::Status AddSignsOfForeignWrites(Database* database) {
  HYPERMAP_RETURN_IF_ERROR(database->Execute(kAddForeignWrites));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<std::string> tables, LayerTables(database, ""));
  tables.emplace_back(kContentsTable);
  for (const std::string& table : tables) {
    HYPERMAP_RETURN_IF_ERROR(WatchForForeignWrites(database, table));
  }
  return absl::OkStatus();
}

constexpr Migration kMigrations[] = {
    {1, AddFusion},      {2, AddHistory},   {3, AllowEveryShape},        {4, AddTimeMarks},
    {5, AddIncarnation}, {6, AddRetention}, {7, AddSignsOfForeignWrites}};

}  // namespace

absl::Span<const Migration> ReleasedMigrations() { return kMigrations; }

}  // namespace hypermap::storage
