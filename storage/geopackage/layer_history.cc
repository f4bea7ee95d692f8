#include "storage/geopackage/layer_history.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/frame_table.h"

namespace hypermap::storage {
namespace {

constexpr char kInsertLineage[] = R"sql(
INSERT INTO hypermap_lineages (name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw,
    resolution_m, first_revision)
  SELECT name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw, resolution_m, ?2
    FROM hypermap_layers WHERE name = ?1
  RETURNING id
)sql";

constexpr char kRecordLayer[] = R"sql(
INSERT OR REPLACE INTO hypermap_layer_history
  SELECT lineage, ?2, row_begin, row_end, col_begin, col_end, parameters
    FROM hypermap_layers WHERE name = ?1
)sql";

// Columns as ReadLayerRow reads them, then the version.
constexpr char kLayersAt[] = R"sql(
SELECT l.name, l.kind, l.table_name, l.frame_id, l.origin_x, l.origin_y, l.origin_yaw,
    l.resolution_m, h.row_begin, h.row_end, h.col_begin, h.col_end, h.parameters, l.id,
    (SELECT max(revision) FROM hypermap_layer_revisions WHERE lineage = l.id AND revision <= ?1)
  FROM hypermap_lineages AS l CROSS JOIN hypermap_layer_history AS h
    ON h.lineage = l.id AND h.first_revision = (SELECT max(first_revision)
      FROM hypermap_layer_history WHERE lineage = l.id AND first_revision <= ?1)
  WHERE l.first_revision <= ?1 AND (l.end_revision IS NULL OR l.end_revision > ?1)
  ORDER BY l.name
)sql";

constexpr char kLineage[] = R"sql(
SELECT l.name, l.kind, l.table_name, l.frame_id, l.origin_x, l.origin_y, l.origin_yaw,
    l.resolution_m, h.row_begin, h.row_end, h.col_begin, h.col_end, h.parameters, l.id,
    l.end_revision
  FROM hypermap_lineages AS l CROSS JOIN hypermap_layer_history AS h
    ON h.lineage = l.id
  WHERE l.id = ? ORDER BY h.first_revision LIMIT 1
)sql";

constexpr char kFramesAt[] = R"sql(
SELECT h.child_frame_id, h.parent_frame_id, h.x, h.y, h.yaw
  FROM hypermap_frames AS f CROSS JOIN hypermap_frame_history AS h
    ON h.child_frame_id = f.child_frame_id AND h.first_revision = (SELECT max(first_revision)
      FROM hypermap_frame_history WHERE child_frame_id = f.child_frame_id AND first_revision <= ?1)
  ORDER BY h.child_frame_id
)sql";

constexpr int kColumnAfterLayer = 14;

}  // namespace

absl::StatusOr<int64_t> BeginLineage(Database* database, const std::string& layer,
                                     Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> lineage,
                            database->QueryInt64(kInsertLineage, layer, revision));
  if (!lineage) return absl::InternalError(absl::StrCat("no layer ", layer));
  HYPERMAP_RETURN_IF_ERROR(
      database->Run("UPDATE hypermap_layers SET lineage = ? WHERE name = ?", *lineage, layer));
  HYPERMAP_RETURN_IF_ERROR(RecordLayer(database, layer, revision));
  return *lineage;
}

absl::Status EndLineage(Database* database, int64_t lineage, Revision revision) {
  return database->Run("UPDATE hypermap_lineages SET end_revision = ? WHERE id = ?", revision,
                       lineage);
}

absl::Status RecordLayer(Database* database, const std::string& layer, Revision revision) {
  return database->Run(kRecordLayer, layer, revision);
}

absl::Status RecordLayerRevision(Database* database, int64_t lineage, Revision revision) {
  return database->Run("INSERT OR IGNORE INTO hypermap_layer_revisions VALUES (?, ?)", lineage,
                       revision);
}

absl::StatusOr<Revision> NewestRevisionOf(Database* database, int64_t lineage) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> newest,
      database->QueryInt64("SELECT max(revision) FROM hypermap_layer_revisions WHERE lineage = ?",
                           lineage));
  return newest.value_or(0);
}

absl::Status RecordTransform(Database* database, const FrameTransform& transform,
                             Revision revision) {
  const PlanarTransform& t = transform.parent_from_child;
  return database->Run(
      "INSERT OR REPLACE INTO hypermap_frame_history "
      "(child_frame_id, first_revision, parent_frame_id, x, y, yaw) VALUES (?, ?, ?, ?, ?, ?)",
      transform.child_frame_id, revision, transform.parent_frame_id, t.x(), t.y(), t.yaw());
}

absl::StatusOr<std::vector<PastLayer>> ReadLayersAt(Database* database, Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database->Prepare(kLayersAt));
  select.Bind(revision);
  std::vector<PastLayer> layers;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return layers;
    absl::StatusOr<StoredLayer> stored = ReadLayerRow(&select);
    const Revision version = select.OptionalInt64(kColumnAfterLayer).value_or(0);
    absl::Status status = stored.status();
    if (status.ok()) status = select.row_status();
    if (!status.ok()) {
      return absl::DataLossError(
          absl::StrCat("hypermap_lineages, layer ", select.Text(0), ": ", status.message()));
    }
    layers.push_back({*std::move(stored), version});
  }
}

absl::StatusOr<Lineage> ReadLineage(Database* database, int64_t lineage) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database->Prepare(kLineage));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(lineage).Step());
  if (!has_row) {
    return absl::DataLossError(absl::StrCat("hypermap_lineages has no lineage ", lineage));
  }
  absl::StatusOr<StoredLayer> stored = ReadLayerRow(&select);
  if (!stored.ok()) {
    return absl::DataLossError(
        absl::StrCat("hypermap_lineages, id ", lineage, ": ", stored.status().message()));
  }
  return Lineage{*std::move(stored), select.IsNull(kColumnAfterLayer)};
}

absl::StatusOr<FrameTree> ReadFramesAt(Database* database, Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database->Prepare(kFramesAt));
  return ReadFrameRows(&select.Bind(revision), "hypermap_frame_history");
}

}  // namespace hypermap::storage
