#include "storage/postgres/map_check.h"

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/encoding/change_columns.h"
#include "storage/encoding/frame_columns.h"
#include "storage/encoding/object_id_list.h"
#include "storage/encoding/tile_codec.h"
#include "storage/finding_list.h"
#include "storage/postgres/change_page.h"
#include "storage/postgres/check_rules.h"
#include "storage/postgres/each_row.h"
#include "storage/postgres/evidence_check.h"
#include "storage/postgres/layer_versions.h"
#include "storage/postgres/map_row.h"
#include "storage/postgres/object_row.h"
#include "storage/postgres/row_names.h"
#include "storage/postgres/schema.h"
#include "storage/postgres/tile_versions.h"
#include "storage/postgres/time_marks.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kFramesTable[] = "hypermap.frame_versions";
constexpr char kLayersTable[] = "hypermap.layer_versions";
constexpr char kObjectsTable[] = "hypermap.objects";
constexpr char kTilesTable[] = "hypermap.tiles";
constexpr char kChangesTable[] = "hypermap.changes";
constexpr char kReceiptsTable[] = "hypermap.receipts";

// $map stands for the number of the map.
constexpr char kAllFrames[] =
    "SELECT child_frame_id, parent_frame_id, x, y, yaw, 'frame ' || child_frame_id || "
    "', version ' || first_revision FROM hypermap.frame_versions WHERE map = $map";
// $columns stands for kLayerColumns.
constexpr char kAllLayers[] =
    "SELECT $columns, 'lineage ' || l.lineage || ', version ' || v.first_revision "
    "FROM hypermap.lineages AS l JOIN hypermap.layer_versions AS v USING (map, lineage) "
    "WHERE map = $map ORDER BY l.lineage, v.first_revision";
// $columns stands for kObjectColumns and $name for kObjectName. The first corner of a box is the
// upper right one.
constexpr char kAllObjects[] =
    "SELECT $columns, v.lineage, (bounds[1])[0], (bounds[1])[1], (bounds[0])[0], (bounds[0])[1], "
    "$name FROM hypermap.objects AS v WHERE map = $map";
// $wkb stands for kWkbOfShape and $name for kObjectName.
constexpr char kOtherGeometries[] =
    "SELECT $name FROM hypermap.objects AS v WHERE map = $1 "
    "AND ST_AsBinary(geom, 'NDR') IS DISTINCT FROM $wkb";
// $name stands for kTileName.
constexpr char kAllTiles[] =
    "SELECT v.lineage, v.tile_row, v.tile_col, v.image, $name FROM hypermap.tiles AS v "
    "WHERE map = $map";
constexpr char kAllReceipts[] =
    "SELECT request_id, object_ids FROM hypermap.receipts WHERE map = $map";

class MapChecker {
 public:
  // Everything is read within a snapshot transaction of the connection.
  MapChecker(Connection& connection, int64_t map, const EvidenceCheck& evidence)
      : connection_(connection), map_(map), evidence_(evidence) {}

  absl::StatusOr<CheckReport> Run();

 private:
  using Part = absl::FunctionRef<absl::Status()>;

  // Runs a part of the check. Damage that ends it is a finding, and the other parts go on.
  absl::Status InPart(const std::string& table, Part part);
  absl::Status CheckByRule(const CheckRule& rule);
  absl::Status CheckFrames();
  absl::Status CheckLayers();
  absl::Status CheckObjects();
  absl::Status CheckObject(Rows* row) const;
  // The column of PostGIS, if there is one.
  absl::Status CheckGeometries();
  absl::Status CheckTiles();
  absl::Status CheckTile(Rows* row) const;
  absl::Status CheckChanges();
  // DATA_LOSS if the change can't be decoded or leads to nothing.
  absl::Status Resolve(const LoggedChange& change) const;
  absl::Status CheckReceipts();

  // Calls `check` for each row of a query, whose column `name` has the name of the row.
  absl::Status CheckEach(const char* table, const std::string& sql, int name,
                         absl::FunctionRef<absl::Status(Rows*)> check);
  std::string OfMap(const std::string& sql) const {
    return absl::StrReplaceAll(sql, {{"$map", absl::StrCat(map_)}});
  }
  // DATA_LOSS.
  absl::StatusOr<const StoredLayer*> LayerOf(int64_t lineage) const;

  Connection& connection_;
  const int64_t map_;
  const EvidenceCheck& evidence_;
  KeptRevisions kept_;
  std::map<int64_t, StoredLayer> layers_;  // by lineage; as their newest versions have them
  FindingList findings_;
};

absl::StatusOr<CheckReport> MapChecker::Run() {
  HYPERMAP_ASSIGN_OR_RETURN(const MapPosition position, ReadPosition(&connection_, map_));
  kept_ = position.kept;
  findings_.set_revision(kept_.newest);
  HYPERMAP_RETURN_IF_ERROR(InPart(kFramesTable, [&] { return CheckFrames(); }));
  HYPERMAP_RETURN_IF_ERROR(InPart(kLayersTable, [&] { return CheckLayers(); }));
  HYPERMAP_RETURN_IF_ERROR(
      InPart("hypermap.time_marks", [&] { return ReadTimeMarks(connection_, map_).status(); }));
  for (const CheckRule& rule : HistoryRules()) HYPERMAP_RETURN_IF_ERROR(CheckByRule(rule));
  HYPERMAP_RETURN_IF_ERROR(InPart(kObjectsTable, [&] { return CheckObjects(); }));
  HYPERMAP_RETURN_IF_ERROR(CheckGeometries());
  HYPERMAP_RETURN_IF_ERROR(InPart(kTilesTable, [&] { return CheckTiles(); }));
  HYPERMAP_RETURN_IF_ERROR(InPart(kChangesTable, [&] { return CheckChanges(); }));
  HYPERMAP_RETURN_IF_ERROR(InPart(kReceiptsTable, [&] { return CheckReceipts(); }));
  for (const CheckRule& rule : EvidenceRules()) HYPERMAP_RETURN_IF_ERROR(CheckByRule(rule));
  for (const EvidenceTable& table : EvidenceTables()) {
    HYPERMAP_RETURN_IF_ERROR(InPart(table.name, [&] {
      return CheckEvidence(connection_, map_, table, evidence_, &findings_);
    }));
  }
  return std::move(findings_).Take();
}

absl::Status MapChecker::InPart(const std::string& table, Part part) {
  HYPERMAP_RETURN_IF_ERROR(connection_.Execute("SAVEPOINT part"));
  const absl::Status status = part();
  if (!status.ok()) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_RETURN_IF_ERROR(connection_.Execute("ROLLBACK TO SAVEPOINT part"));
  }
  HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage(table, "", status));
  return connection_.Execute("RELEASE SAVEPOINT part");
}

absl::Status MapChecker::CheckByRule(const CheckRule& rule) {
  return InPart(rule.about.table, [&]() -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                              connection_.Query(rule.sql, map_, kept_.oldest, kept_.newest));
    while (rows.Next()) {
      findings_.Add({rule.about.table, std::string(rows.Text(0)), rule.about.problem});
    }
    return rows.row_status();
  });
}

absl::Status MapChecker::CheckEach(const char* table, const std::string& sql, int name,
                                   absl::FunctionRef<absl::Status(Rows*)> check) {
  return ForEachRow(connection_, OfMap(sql), [&](Rows* row) -> absl::Status {
    absl::Status status = check(row);
    if (status.ok()) return status;
    // What no store would have been given is damage, too.
    return findings_.AddDamage(table, std::string(row->Text(name)),
                               absl::DataLossError(status.message()));
  });
}

absl::Status MapChecker::CheckFrames() {
  constexpr int kNameColumn = 5;
  HYPERMAP_RETURN_IF_ERROR(CheckEach(kFramesTable, kAllFrames, kNameColumn, [](Rows* row) {
    FrameTree alone;
    return AddFrameOf(row, &alone);
  }));
  return ReadFramesAt(connection_, map_, kept_.newest).status();
}

absl::Status MapChecker::CheckLayers() {
  const std::string sql = absl::StrReplaceAll(kAllLayers, {{"$columns", kLayerColumns}});
  return CheckEach(kLayersTable, sql, kNumLayerColumns, [&](Rows* row) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(StoredLayer layer, ReadLayerRow(row));
    const int64_t lineage = layer.lineage;
    layers_.insert_or_assign(lineage, std::move(layer));
    return absl::OkStatus();
  });
}

absl::StatusOr<const StoredLayer*> MapChecker::LayerOf(int64_t lineage) const {
  const auto layer = layers_.find(lineage);
  if (layer != layers_.end()) return &layer->second;
  return absl::DataLossError(absl::StrCat("lineage ", lineage, " is no layer that can be read"));
}

absl::Status MapChecker::CheckObjects() {
  constexpr int kNameColumn = kNumObjectColumns + 5;
  const std::string sql =
      absl::StrReplaceAll(kAllObjects, {{"$columns", kObjectColumns}, {"$name", kObjectName}});
  return CheckEach(kObjectsTable, sql, kNameColumn, [&](Rows* row) { return CheckObject(row); });
}

absl::Status MapChecker::CheckObject(Rows* row) const {
  HYPERMAP_ASSIGN_OR_RETURN(const ObjectPtr object, ReadObjectRow(row));
  int column = kNumObjectColumns;
  const int64_t lineage = row->Int64(column++);
  Box bounds;
  bounds.min = {row->Double(column), row->Double(column + 1)};
  bounds.max = {row->Double(column + 2), row->Double(column + 3)};
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  if (bounds != object->shape.bounds()) {
    return absl::DataLossError("the bounds are not those of the shape");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const StoredLayer* const layer, LayerOf(lineage));
  if (layer->spec.shape_kinds.Contains(object->shape.kind())) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("the layer takes no shapes of the kind ", ShapeKindName(object->shape.kind())));
}

absl::Status MapChecker::CheckGeometries() {
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_geometry, HasGeometry(&connection_));
  if (!has_geometry) return absl::OkStatus();
  return CheckByRule(
      {{kObjectsTable, "", "the geometry column is not the shape"},
       absl::StrReplaceAll(kOtherGeometries, {{"$wkb", kWkbOfShape}, {"$name", kObjectName}})});
}

absl::Status MapChecker::CheckTiles() {
  constexpr int kNameColumn = 4;
  const std::string sql = absl::StrReplaceAll(kAllTiles, {{"$name", kTileName}});
  return CheckEach(kTilesTable, sql, kNameColumn, [&](Rows* row) { return CheckTile(row); });
}

absl::Status MapChecker::CheckTile(Rows* row) const {
  const int64_t lineage = row->Int64(0);
  HYPERMAP_ASSIGN_OR_RETURN(const TileIndex index, ToTileIndex(row->Int64(1), row->Int64(2)));
  const absl::string_view image = row->Blob(3);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  HYPERMAP_ASSIGN_OR_RETURN(const StoredLayer* const layer, LayerOf(lineage));
  const std::unique_ptr<const TileCodec> codec = MakeTileCodec(layer->spec.kind);
  if (codec == nullptr) return absl::DataLossError("the layer is not a grid");
  HYPERMAP_ASSIGN_OR_RETURN(const TilePtr tile, codec->Decode(image));
  // Extents only grow.
  if (KnownOnlyIn(layer->extent, index, *tile)) return absl::OkStatus();
  return absl::DataLossError("the tile has known cells outside of the layer's extent");
}

absl::Status MapChecker::CheckChanges() {
  ChangePlace place{kept_.oldest, std::numeric_limits<int64_t>::max()};
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const ChangePage page,
                              ReadChangePage(connection_, map_, place, kept_.newest));
    for (const LoggedChange& change : page.changes) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      HYPERMAP_RETURN_IF_ERROR(findings_.AddDamage(
          kChangesTable,
          absl::StrCat("revision ", change.place.revision, ", number ", change.place.number),
          Resolve(change)));
    }
    if (!page.may_have_next) return absl::OkStatus();
    place = page.changes.back().place;
  }
}

absl::Status MapChecker::Resolve(const LoggedChange& change) const {
  if (change.lineage == 0) {
    return DecodeStructureChange(change.kind, change.detail, LayerSpec()).status();
  }
  HYPERMAP_ASSIGN_OR_RETURN(const StoredLayer* const layer, LayerOf(change.lineage));
  if (change.kind == kTileWritten) {
    if (change.after) return ToTileIndex(change.tile_row, change.tile_col).status();
    return absl::DataLossError(absl::StrCat("writes the tile of tile_row ", change.tile_row,
                                            ", tile_col ", change.tile_col,
                                            ", which is not there"));
  }
  if (change.kind == kObjectPut) {
    if (change.after) return absl::OkStatus();
    return absl::DataLossError(
        absl::StrCat("puts the object ", change.object_id, ", which is not there"));
  }
  if (change.kind == kObjectRemoved) {
    if (change.before) return absl::OkStatus();
    return absl::DataLossError(
        absl::StrCat("removes the object ", change.object_id, ", which was not there"));
  }
  return DecodeStructureChange(change.kind, change.detail, layer->spec).status();
}

absl::Status MapChecker::CheckReceipts() {
  return ForEachRow(connection_, OfMap(kAllReceipts), [&](Rows* row) -> absl::Status {
    absl::Status status = DecodeObjectIds(row->Blob(1)).status();
    status.Update(row->row_status());
    return findings_.AddDamage(kReceiptsTable, absl::StrCat("request_id ", row->Text(0)), status);
  });
}

class SnapshotCheck : public MapCheck {
 public:
  SnapshotCheck(ConnectOptions options, int64_t map, std::string name)
      : options_(std::move(options)), map_(map), name_(std::move(name)) {}

  absl::StatusOr<CheckReport> Run(const EvidenceCheck& evidence) override {
    absl::StatusOr<CheckReport> report = RunInSnapshot(evidence);
    if (report.ok()) return report;
    return absl::Status(report.status().code(),
                        absl::StrCat("map ", name_, ": ", report.status().message()));
  }

 private:
  absl::StatusOr<CheckReport> RunInSnapshot(const EvidenceCheck& evidence) const {
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection,
                              Connection::Open(options_));
    HYPERMAP_ASSIGN_OR_RETURN(const Transaction transaction,
                              Transaction::Begin(connection.get(), Transaction::Kind::kSnapshot));
    return MapChecker(*connection, map_, evidence).Run();
  }

  const ConnectOptions options_;
  const int64_t map_;
  const std::string name_;
};

}  // namespace

std::unique_ptr<MapCheck> MakeMapCheck(ConnectOptions options, int64_t map, std::string name) {
  return std::make_unique<SnapshotCheck>(std::move(options), map, std::move(name));
}

}  // namespace hypermap::storage::postgres
