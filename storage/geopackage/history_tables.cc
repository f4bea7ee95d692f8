#include "storage/geopackage/history_tables.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/status/statusor.h"
#include "storage/encoding/geometry_blob.h"

namespace hypermap::storage {

const char kCreateReceipts[] = R"sql(
CREATE TABLE hypermap_receipts (
  id INTEGER PRIMARY KEY,
  request_id TEXT NOT NULL UNIQUE,
  revision INTEGER NOT NULL,
  time_ns INTEGER NOT NULL,
  object_ids BLOB NOT NULL,
  digest BLOB
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

VersionBox BoxOfVersion(absl::string_view geometry, int64_t first_revision, int64_t end_revision,
                        int64_t lineage) {
  constexpr double kFar = 1e300;
  const absl::StatusOr<Box> found = BoxOfGeometryBlob(geometry);
  const MillimetreBox box =
      ToMillimetres(found.ok() && !found->empty() ? *found : Box{{-kFar, -kFar}, {kFar, kFar}});
  return {box.min_x,
          box.max_x,
          box.min_y,
          box.max_y,
          ClampToInt32(first_revision),
          ClampToInt32(end_revision - 1),
          ClampToInt32(lineage),
          ClampToInt32(lineage + 1)};
}

absl::Status InsertVersionBox(Database* database, int64_t id, const VersionBox& box) {
  return database->Run("INSERT INTO hypermap_object_boxes VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", id,
                       box[0], box[1], box[2], box[3], box[4], box[5], box[6], box[7]);
}

}  // namespace hypermap::storage
