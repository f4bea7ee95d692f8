#include "storage/geopackage/history_check.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "storage/encoding/change_columns.h"
#include "storage/encoding/tile_codec.h"
#include "storage/geopackage/change_log.h"
#include "storage/geopackage/find_rows.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/object_row.h"
#include "storage/geopackage/tile_matrix.h"

namespace hypermap::storage {
namespace {

constexpr char kObjectHistory[] = "hypermap_object_history";
constexpr char kTileHistory[] = "hypermap_tile_history";
constexpr char kChangeLog[] = "hypermap_changes";

// A rule of the tables. The query answers with the rows that break it, each as text. $oldest and
// $newest stand for the kept revisions; rows that only older ones need may be gone in part.
struct Rule {
  const char* table;
  const char* problem;
  const char* sql;
};
constexpr Rule kRules[] = {
    {"hypermap_revisions", "the revision is missing",
     "WITH kept (revision) AS (SELECT max($oldest - 1, 0) UNION SELECT revision FROM "
     "hypermap_revisions WHERE revision >= $oldest UNION SELECT $newest + 1) "
     "SELECT 'revision ' || (revision + 1) || CASE WHEN later > revision + 2 THEN ' to ' || "
     "(later - 1) ELSE '' END FROM (SELECT revision, lead(revision) OVER (ORDER BY revision) AS "
     "later FROM kept) WHERE later > revision + 1"},
    {"hypermap_revisions", "the revision is newer than the map's",
     "SELECT 'revision ' || revision FROM hypermap_revisions WHERE revision > $newest"},
    {"hypermap_revisions", "the time is before that of the revision before",
     "SELECT 'revision ' || revision FROM (SELECT revision, time_ns, lag(time_ns) OVER (ORDER BY "
     "revision) AS earlier FROM hypermap_revisions) WHERE time_ns < earlier"},
    {"hypermap_revisions", "hypermap_changes has another number of changes",
     "SELECT 'revision ' || revision FROM hypermap_revisions AS r WHERE revision > $oldest AND "
     "num_changes <> (SELECT count(*) FROM hypermap_changes AS c WHERE c.revision = r.revision)"},
    {"hypermap_layers", "no lineage is that of the layer",
     "SELECT 'layer ' || name FROM hypermap_layers WHERE lineage NOT IN "
     "(SELECT id FROM hypermap_lineages WHERE end_revision IS NULL)"},
    {"hypermap_lineages", "the lineage has not ended, but there is no such layer",
     "SELECT 'id ' || id FROM hypermap_lineages WHERE end_revision IS NULL AND id NOT IN "
     "(SELECT lineage FROM hypermap_layers)"},
    {"hypermap_lineages", "hypermap_layer_history has no row of the lineage",
     "SELECT 'id ' || id FROM hypermap_lineages AS l WHERE NOT EXISTS "
     "(SELECT 1 FROM hypermap_layer_history AS h WHERE h.lineage = l.id)"},
    {kObjectHistory, "there is no such lineage",
     "SELECT 'id ' || id FROM hypermap_object_history WHERE end_revision > $oldest AND lineage "
     "NOT IN (SELECT id FROM hypermap_lineages)"},
    {kObjectHistory, "the version ends before it begins, or after the newest revision",
     "SELECT 'id ' || id FROM hypermap_object_history "
     "WHERE first_revision > end_revision OR end_revision > $newest"},
    {kTileHistory, "there is no such lineage",
     "SELECT 'id ' || id FROM hypermap_tile_history WHERE end_revision > $oldest AND lineage "
     "NOT IN (SELECT id FROM hypermap_lineages)"},
    {kTileHistory, "the version ends after the newest revision",
     "SELECT 'id ' || id FROM hypermap_tile_history WHERE end_revision > $newest"},
    {kObjectBoxesTable, "there is no such version",
     "SELECT 'id ' || b.id FROM hypermap_object_boxes AS b WHERE NOT EXISTS "
     "(SELECT 1 FROM hypermap_object_history AS h WHERE h.id = b.id)"},
    {"hypermap_receipts", "the revision is newer than the map's",
     "SELECT 'request_id ' || request_id FROM hypermap_receipts WHERE revision > $newest"},
};

// $columns stands for the columns of an object, of which none is a column of a box.
constexpr char kVersionsWithBoxes[] = R"sql(
SELECT h.object_id, $columns, h.first_revision, h.id, h.lineage, h.end_revision, b.id,
    b.min_x, b.max_x, b.min_y, b.max_y, b.first_revision, b.last_revision, b.min_lineage,
    b.max_lineage
  FROM hypermap_object_history AS h LEFT JOIN hypermap_object_boxes AS b ON b.id = h.id
)sql";
constexpr int kHistoryIdColumn = kObjectVersionColumn + 1;
constexpr int kLineageColumn = kHistoryIdColumn + 1;
constexpr int kEndRevisionColumn = kHistoryIdColumn + 2;
constexpr int kBoxIdColumn = kHistoryIdColumn + 3;

constexpr char kReplacedTiles[] =
    "SELECT t.id, t.tile_column, t.tile_row, t.tile_data, l.kind FROM hypermap_tile_history AS t "
    "JOIN hypermap_lineages AS l ON l.id = t.lineage WHERE t.tile_data IS NOT NULL";

// The versions of objects and tiles that changes name. $t stands for the name of the layer's table,
// which needs no escapes (IsLayerTableName).
constexpr char kReplacedObject[] =
    "SELECT first_revision FROM hypermap_object_history WHERE lineage = ? AND object_id = ? "
    "AND end_revision > ? ORDER BY end_revision LIMIT 1";
constexpr char kObjectThatEnds[] =
    "SELECT 1 FROM hypermap_object_history WHERE lineage = ? AND object_id = ? "
    "AND end_revision = ?";
constexpr char kCurrentObject[] = R"sql(SELECT version FROM "$t" WHERE id = ?)sql";
constexpr char kReplacedTile[] =
    "SELECT tile_data IS NOT NULL FROM hypermap_tile_history WHERE lineage = ? "
    "AND tile_column = ? AND tile_row = ? AND end_revision > ? ORDER BY end_revision LIMIT 1";
constexpr char kTileThatEnds[] =
    "SELECT 1 FROM hypermap_tile_history WHERE lineage = ? AND tile_column = ? AND tile_row = ? "
    "AND end_revision = ?";
constexpr char kCurrentTile[] = R"sql(
SELECT 1 FROM "$t" WHERE zoom_level = 0 AND tile_column = ? AND tile_row = ?
)sql";

class HistoryChecker {
 public:
  HistoryChecker(Database* database, FindingList* findings)
      : database_(database), findings_(findings) {}

  absl::Status Run();

 private:
  absl::Status CheckRules();
  absl::Status CheckObjects();
  absl::Status CheckBox(Statement* row);
  absl::Status CheckTiles();
  absl::Status CheckChanges();

  // DATA_LOSS if the change leads to nothing.
  absl::Status Resolve(const LoggedChange& change);
  absl::Status ResolvePut(const LoggedChange& change, const Lineage& layer);
  absl::Status ResolveTile(const LoggedChange& change, const Lineage& layer);

  Database* const database_;
  FindingList* const findings_;
  std::map<int64_t, absl::StatusOr<Lineage>> lineages_;
};

absl::Status HistoryChecker::Run() {
  HYPERMAP_RETURN_IF_ERROR(CheckRules());
  HYPERMAP_RETURN_IF_ERROR(findings_->AddDamage(kObjectHistory, "", CheckObjects()));
  HYPERMAP_RETURN_IF_ERROR(findings_->AddDamage(kTileHistory, "", CheckTiles()));
  return findings_->AddDamage(kChangeLog, "", CheckChanges());
}

absl::Status HistoryChecker::CheckRules() {
  for (const Rule& rule : kRules) {
    const std::string sql = absl::StrReplaceAll(
        rule.sql, {{"$oldest", "(SELECT oldest_revision FROM hypermap_metadata)"},
                   {"$newest", "(SELECT revision FROM hypermap_metadata)"}});
    // Only the boxes follow from another table.
    const bool can_be_rebuilt = absl::string_view(rule.table) == kObjectBoxesTable;
    HYPERMAP_RETURN_IF_ERROR(
        FindRows(database_, {rule.table, "", rule.problem, can_be_rebuilt}, findings_, sql));
  }
  return absl::OkStatus();
}

absl::Status HistoryChecker::CheckObjects() {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(absl::StrReplaceAll(kVersionsWithBoxes, {{"$columns", kObjectColumns}})));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    const absl::Status status = ReadObjectRow(&select).status();
    if (!status.ok()) {
      HYPERMAP_RETURN_IF_ERROR(
          findings_->AddDamage(kObjectHistory, absl::StrCat("id ", select.Int64(kHistoryIdColumn)),
                               absl::DataLossError(status.message())));
    }
    HYPERMAP_RETURN_IF_ERROR(CheckBox(&select));
  }
}

absl::Status HistoryChecker::CheckBox(Statement* row) {
  const std::string name = absl::StrCat("id ", row->Int64(kHistoryIdColumn));
  if (row->IsNull(kBoxIdColumn)) {
    findings_->Add({kObjectBoxesTable, name, "the version has no box", true});
    return absl::OkStatus();
  }
  const VersionBox expected =
      BoxOfVersion(row->Blob(1), row->Int64(kObjectVersionColumn), row->Int64(kEndRevisionColumn),
                   row->Int64(kLineageColumn));
  VersionBox box;
  for (size_t i = 0; i < box.size(); ++i) {
    box[i] = row->Int64(kBoxIdColumn + 1 + static_cast<int>(i));
  }
  if (box != expected) {
    findings_->Add({kObjectBoxesTable, name, "the box is not that of the version", true});
  }
  return absl::OkStatus();
}

absl::Status HistoryChecker::CheckTiles() {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database_->Prepare(kReplacedTiles));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    const MatrixTile place{select.Int64(1), select.Int64(2)};
    const absl::string_view image = select.Blob(3);
    const std::optional<LayerKind> kind = ParseLayerKind(select.Text(4));
    absl::Status status = select.row_status();
    const std::unique_ptr<const TileCodec> codec = kind ? MakeTileCodec(*kind) : nullptr;
    if (status.ok() && codec == nullptr) status = absl::DataLossError("a tile of no grid");
    if (status.ok()) status = codec->Decode(image).status();
    if (status.ok() && !IsInMatrix(place)) {
      status = absl::DataLossError("the tile lies outside of the tile matrix");
    }
    HYPERMAP_RETURN_IF_ERROR(
        findings_->AddDamage(kTileHistory, absl::StrCat("id ", select.Int64(0)), status));
  }
}

absl::Status HistoryChecker::CheckChanges() {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database_->Prepare(absl::StrCat(
                                                  "SELECT ", kLoggedChangeColumns,
                                                  ", number FROM hypermap_changes WHERE revision > "
                                                  "(SELECT oldest_revision FROM hypermap_metadata) "
                                                  "ORDER BY revision, number")));
  constexpr int kNumberColumn = 7;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    const absl::StatusOr<LoggedChange> change = ReadLoggedChange(&select);
    const absl::Status status = change.ok() ? Resolve(*change) : change.status();
    if (status.ok()) continue;
    HYPERMAP_RETURN_IF_ERROR(findings_->AddDamage(
        kChangeLog,
        absl::StrCat("revision ", select.Int64(0), ", number ", select.Int64(kNumberColumn)),
        status));
  }
}

absl::Status HistoryChecker::Resolve(const LoggedChange& change) {
  if (change.lineage == 0)
    return DecodeStructureChange(change.kind, change.detail, LayerSpec()).status();
  auto found = lineages_.find(change.lineage);
  if (found == lineages_.end()) {
    found = lineages_.emplace(change.lineage, ReadLineage(database_, change.lineage)).first;
  }
  HYPERMAP_RETURN_IF_ERROR(found->second.status());
  const Lineage& layer = *found->second;
  if (change.kind == kObjectPut) return ResolvePut(change, layer);
  if (change.kind == kTileWritten) return ResolveTile(change, layer);
  if (change.kind != kObjectRemoved)
    return DecodeStructureChange(change.kind, change.detail, layer.stored.spec).status();
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> before,
      database_->QueryInt64(kObjectThatEnds, change.lineage, change.object_id, change.revision));
  if (before) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("removes the object ", change.object_id,
                                          ", which is not in hypermap_object_history"));
}

absl::Status HistoryChecker::ResolvePut(const LoggedChange& change, const Lineage& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      std::optional<int64_t> version,
      database_->QueryInt64(kReplacedObject, change.lineage, change.object_id, change.revision));
  if (!version && layer.is_current) {
    HYPERMAP_ASSIGN_OR_RETURN(
        version,
        database_->QueryInt64(ForTable(kCurrentObject, layer.stored.table), change.object_id));
  }
  if (version && *version <= change.revision) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("puts the object ", change.object_id, " of layer ",
                                          layer.stored.spec.name, ", which is not there"));
}

absl::Status HistoryChecker::ResolveTile(const LoggedChange& change, const Lineage& layer) {
  const auto& [column, row] = change.tile;
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> before,
      database_->QueryInt64(kTileThatEnds, change.lineage, column, row, change.revision));
  if (!before) {
    return absl::DataLossError("hypermap_tile_history does not tell what was there before");
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      std::optional<int64_t> after,
      database_->QueryInt64(kReplacedTile, change.lineage, column, row, change.revision));
  if (!after && layer.is_current) {
    HYPERMAP_ASSIGN_OR_RETURN(
        after, database_->QueryInt64(ForTable(kCurrentTile, layer.stored.table), column, row));
  }
  if (after.value_or(0) != 0) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("writes a tile of layer ", layer.stored.spec.name, " that is not there"));
}

}  // namespace

absl::Status CheckHistory(Database* database, FindingList* findings) {
  return HistoryChecker(database, findings).Run();
}

}  // namespace hypermap::storage
