#include "storage/geopackage/history_tables.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "storage/geopackage/table_names.h"

namespace hypermap::storage {

const char kCreateReceipts[] = R"sql(
CREATE TABLE hypermap_receipts (
  id INTEGER PRIMARY KEY,
  request_id TEXT NOT NULL UNIQUE,
  revision INTEGER NOT NULL,
  time_ns INTEGER NOT NULL,
  object_ids BLOB NOT NULL
);
)sql";

const char kCreateHistoryTables[] = R"sql(
CREATE TABLE hypermap_lineages (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  name TEXT NOT NULL,
  kind TEXT NOT NULL,
  table_name TEXT NOT NULL,
  frame_id TEXT NOT NULL,
  origin_x DOUBLE,
  origin_y DOUBLE,
  origin_yaw DOUBLE,
  resolution_m DOUBLE,
  first_revision INTEGER NOT NULL,
  end_revision INTEGER
);
CREATE TABLE hypermap_layer_history (
  lineage INTEGER NOT NULL,
  first_revision INTEGER NOT NULL,
  row_begin INTEGER,
  row_end INTEGER,
  col_begin INTEGER,
  col_end INTEGER,
  parameters TEXT NOT NULL,
  PRIMARY KEY (lineage, first_revision)
) WITHOUT ROWID;
CREATE TABLE hypermap_layer_revisions (
  lineage INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  PRIMARY KEY (lineage, revision)
) WITHOUT ROWID;
CREATE TABLE hypermap_frame_history (
  child_frame_id TEXT NOT NULL,
  first_revision INTEGER NOT NULL,
  parent_frame_id TEXT NOT NULL,
  x DOUBLE NOT NULL,
  y DOUBLE NOT NULL,
  yaw DOUBLE NOT NULL,
  PRIMARY KEY (child_frame_id, first_revision)
) WITHOUT ROWID;
CREATE TABLE hypermap_object_history (
  id INTEGER PRIMARY KEY,
  lineage INTEGER NOT NULL,
  object_id INTEGER NOT NULL,
  first_revision INTEGER NOT NULL,
  end_revision INTEGER NOT NULL,
  geom BLOB NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL,
  classes TEXT NOT NULL,
  tags TEXT NOT NULL,
  attributes TEXT NOT NULL,
  height_min DOUBLE,
  height_max DOUBLE,
  expires_at_ns INTEGER,
  UNIQUE (lineage, object_id, end_revision)
);
CREATE VIRTUAL TABLE hypermap_object_boxes USING rtree_i32(
  id, min_x, max_x, min_y, max_y, first_revision, last_revision, min_lineage, max_lineage);
CREATE TABLE hypermap_tile_history (
  id INTEGER PRIMARY KEY,
  lineage INTEGER NOT NULL,
  tile_column INTEGER NOT NULL,
  tile_row INTEGER NOT NULL,
  end_revision INTEGER NOT NULL,
  tile_data BLOB,
  UNIQUE (lineage, tile_column, tile_row, end_revision)
);
CREATE TABLE hypermap_changes (
  revision INTEGER NOT NULL,
  number INTEGER NOT NULL,
  kind TEXT NOT NULL,
  lineage INTEGER,
  object_id INTEGER,
  tile_column INTEGER,
  tile_row INTEGER,
  detail TEXT,
  PRIMARY KEY (revision, number)
) WITHOUT ROWID;
)sql";

namespace {

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

// Old receipts had the time of their revision. (Renaming the table instead would read all
// triggers.)
constexpr char kSaveReceipts[] = R"sql(
CREATE TEMP TABLE old_receipts AS
  SELECT c.id, c.request_id, c.revision, r.time_ns, c.object_ids
    FROM hypermap_receipts AS c JOIN hypermap_revisions AS r ON r.revision = c.revision;
DROP TABLE hypermap_receipts;
)sql";
constexpr char kRestoreReceipts[] = R"sql(
INSERT INTO hypermap_receipts SELECT * FROM old_receipts ORDER BY id;
DROP TABLE temp.old_receipts;
)sql";

constexpr char kRegisterNewTables[] = R"sql(
INSERT INTO gpkg_extensions
  SELECT name, NULL, 'hypermap_core', 'docs/geopackage_format.md of Hypermap', 'write-only'
    FROM sqlite_master WHERE type = 'table' AND name LIKE 'hypermap\_%' ESCAPE '\'
      AND name NOT IN (SELECT table_name FROM gpkg_extensions WHERE table_name NOT NULL);
)sql";

absl::StatusOr<std::vector<std::string>> FeatureTables(Database* database) {
  absl::StatusOr<Statement> select =
      database->Prepare("SELECT table_name FROM hypermap_layers WHERE kind = 'semantic'");
  if (!select.ok()) return select.status();
  std::vector<std::string> tables;
  while (true) {
    absl::StatusOr<bool> row = select->Step();
    if (!row.ok()) return row.status();
    if (!*row) return tables;
    tables.emplace_back(select->Text(0));
    if (!IsLayerTableName(tables.back())) {
      return absl::DataLossError(
          absl::StrCat("hypermap_layers: table_name ", tables.back(), " is not for layers"));
    }
  }
}

}  // namespace

absl::Status AddHistory(Database* database) {
  absl::StatusOr<std::vector<std::string>> tables = FeatureTables(database);
  if (!tables.ok()) return tables.status();
  for (const std::string& table : *tables) {
    absl::Status status = database->Execute(absl::StrCat(
        "ALTER TABLE \"", table, "\" ADD COLUMN version INTEGER NOT NULL DEFAULT 0; ALTER TABLE \"",
        table, "\" ADD COLUMN expires_at_ns INTEGER;"));
    if (!status.ok()) return status;
  }
  return database->Execute(absl::StrCat(kSaveReceipts, kCreateReceipts, kRestoreReceipts,
                                        kCreateHistoryTables, kBeginHistory, kRegisterNewTables));
}

namespace {

constexpr int64_t kMax = std::numeric_limits<int32_t>::max();

int64_t Clamped(double value) {
  const double max = kMax;
  return static_cast<int64_t>(std::clamp(value, -max, max));
}

}  // namespace

MillimetreBox ToMillimetres(const Box& box) {
  constexpr double kPerMetre = 1000.0;
  return {Clamped(std::floor(box.min.x * kPerMetre)), Clamped(std::ceil(box.max.x * kPerMetre)),
          Clamped(std::floor(box.min.y * kPerMetre)), Clamped(std::ceil(box.max.y * kPerMetre))};
}

int64_t ClampToInt32(int64_t value) { return std::min(value, kMax); }

}  // namespace hypermap::storage
