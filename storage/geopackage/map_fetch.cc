#include "storage/geopackage/map_fetch.h"

#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "storage/geopackage/change_writer.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/geopackage/layer_table.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/map_repair.h"
#include "storage/geopackage/schema.h"
#include "storage/geopackage/spatial_functions.h"
#include "storage/geopackage/tile_matrix.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {
namespace {

// Names that one error lists at most.
constexpr size_t kMaxNamed = 20;

// $t stands for a layer's table. Its index of places consists of tables of its own.
constexpr char kForget[] = R"sql(
DELETE FROM sqlite_schema WHERE tbl_name IN ('$t', 'rtree_$t_geom', 'rtree_$t_geom_node',
  'rtree_$t_geom_rowid', 'rtree_$t_geom_parent')
)sql";
// The index of places makes its tables by itself.
constexpr char kParts[] = R"sql(
SELECT type, sql FROM sqlite_schema
  WHERE tbl_name IN ('$t', 'rtree_$t_geom') AND sql IS NOT NULL ORDER BY rowid
)sql";

// In the new file, `damaged` and `source` are the attached files, and $s is the layer's table in
// the latter.
//
// The ids of a table, and for tiles their places. $i: NOT INDEXED, or the index to read instead of
// the table.
constexpr char kObjectIds[] = R"sql(SELECT id, id, 0 FROM damaged."$t" $i ORDER BY id)sql";
constexpr char kTileIds[] = R"sql(
SELECT id, tile_column, tile_row FROM damaged."$t" $i ORDER BY id
)sql";
constexpr char kIndexOfObjects[] = R"sql(INDEXED BY "hypermap_$t_label")sql";
constexpr char kIndexOfTiles[] = R"sql(INDEXED BY "sqlite_autoindex_$t_1")sql";
constexpr char kCopyRow[] =
    R"sql(INSERT INTO main."$t" SELECT * FROM damaged."$t" WHERE id = ?)sql";
// Whether the row was changed after the source's revision.
constexpr char kObjectChanged[] = R"sql(
SELECT count(*) FROM damaged.hypermap_changes
  WHERE lineage = ?1 AND revision > ?2 AND object_id = ?3 AND ?4 = 0
)sql";
constexpr char kTileChanged[] = R"sql(
SELECT count(*) FROM damaged.hypermap_changes
  WHERE lineage = ?1 AND revision > ?2 AND tile_column = ?3 AND tile_row = ?4
)sql";
// The version of an object in a replica is not the one in the map: the history tells that, if it
// still has the revision, and otherwise any revision before the history will do.
constexpr char kFetchObject[] = R"sql(
INSERT INTO main."$t" SELECT id, geom, label, existence, classes, tags, attributes, height_min,
    height_max,
    coalesce((SELECT max(revision) FROM damaged.hypermap_changes
                WHERE lineage = ?3 AND object_id = ?4 AND kind = 'put'),
             min(version, (SELECT oldest_revision FROM damaged.hypermap_metadata))),
    expires_at_ns
  FROM source."$s" WHERE id = ?4 AND ?1 = ?4 AND ?2 = 0
)sql";
constexpr char kFetchTile[] = R"sql(
INSERT INTO main."$t" (id, zoom_level, tile_column, tile_row, tile_data)
  SELECT ?4, zoom_level, tile_column, tile_row, tile_data FROM source."$s"
    WHERE zoom_level = 0 AND tile_column = ?1 AND tile_row = ?2
)sql";

// A map's file for reading, with the state that tells which map it is.
struct KnownFile {
  std::unique_ptr<Database> database;
  MapMetadata metadata;
  std::vector<StoredLayer> layers;
};

absl::StatusOr<KnownFile> OpenToRead(const std::string& path) {
  KnownFile file;
  HYPERMAP_ASSIGN_OR_RETURN(
      file.database, Database::Open(path, ModeForReading(path), GeoPackageOptions().busy_timeout));
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t version, ReadSchemaVersion(file.database.get()));
  HYPERMAP_RETURN_IF_ERROR(CheckIsOfThisVersion(version));
  HYPERMAP_ASSIGN_OR_RETURN(file.metadata, ReadMetadata(file.database.get()));
  HYPERMAP_ASSIGN_OR_RETURN(file.layers, ReadLayers(file.database.get()));
  return file;
}

absl::StatusOr<std::optional<int64_t>> TimeOf(const KnownFile& file, Revision revision) {
  return file.database->QueryInt64("SELECT time_ns FROM hypermap_revisions WHERE revision = ?",
                                   revision);
}

absl::Status CheckSameMap(const KnownFile& damaged, const KnownFile& source) {
  const MapMetadata& of_source = source.metadata;
  const Revision revision = of_source.revision;
  if (of_source.header.created_at != damaged.metadata.header.created_at) {
    return absl::FailedPreconditionError("it is a copy of another map");
  }
  if (revision < damaged.metadata.oldest_revision || revision > damaged.metadata.revision) {
    return absl::FailedPreconditionError(absl::StrCat(
        "it is of revision ", revision, ", and the history of the damaged file covers ",
        damaged.metadata.oldest_revision, " to ", damaged.metadata.revision));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> there, TimeOf(source, revision));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> here, TimeOf(damaged, revision));
  if (there && here == there) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("its revision ", revision, " is another one than that of the damaged file"));
}

struct DamagedTable {
  StoredLayer layer;
  bool lacks_rows = false;  // Some can't be read.
  // Rows that can be read, but are not what the layer may contain.
  std::set<int64_t> invalid;
};

const char* IndexOf(const StoredLayer& layer) {
  return IsGridKind(layer.spec.kind) ? kIndexOfTiles : kIndexOfObjects;
}

// OK if the layer's indexes can be read. DATA_LOSS.
absl::Status ReadIndexes(Database* database, const StoredLayer& layer) {
  std::vector<std::string> counts = {absl::StrCat("SELECT count(*) FROM \"$t\" ", IndexOf(layer))};
  if (!IsGridKind(layer.spec.kind)) {
    for (const char* part : {"node", "rowid", "parent"}) {
      counts.push_back(absl::StrCat("SELECT count(*) FROM \"rtree_$t_geom_", part, "\""));
    }
  }
  for (const std::string& count : counts) {
    HYPERMAP_RETURN_IF_ERROR(database->QueryInt64(ForTable(count, layer.table)).status());
  }
  return absl::OkStatus();
}

// Reads all of a layer and of its indexes. nullopt if nothing is wrong.
absl::StatusOr<std::optional<DamagedTable>> FindDamage(Database* database,
                                                       const StoredLayer& stored) {
  DamagedTable damaged{stored, {}};
  const OpenLayer layer = MakeOpenLayer(database, stored);
  const auto note = [&](int64_t id, const auto& row) {
    if (!row.ok()) damaged.invalid.insert(id);
    return absl::OkStatus();
  };
  absl::Status status = layer.grid != nullptr ? layer.grid->ForEach(stored.extent, note)
                                              : layer.features->ForEach(note);
  damaged.lacks_rows = absl::IsDataLoss(status);
  if (status.ok()) status = ReadIndexes(database, stored);
  if (!status.ok() && !absl::IsDataLoss(status)) return status;
  if (status.ok() && damaged.invalid.empty()) return std::nullopt;
  return damaged;
}

// Writes the new file.
class MapFetcher {
 public:
  MapFetcher(KnownFile damaged, KnownFile source, std::string fresh)
      : damaged_(std::move(damaged)), source_(std::move(source)), fresh_(std::move(fresh)) {}

  // The file at `work`, which may be changed, is a copy of the damaged one.
  absl::StatusOr<std::vector<FetchReport::Layer>> Write(const std::string& work);

 private:
  // What a damaged layer has besides its rows.
  struct Part {
    std::string type;
    std::string sql;
  };

  absl::Status FindDamagedLayers();
  // Forgets the damaged layers' tables in `work`, and writes the rest to the new file.
  absl::Status WriteOthers(const std::string& work);
  absl::StatusOr<std::vector<Part>> PartsOf(const std::string& table);
  absl::Status Attach();
  absl::Status WriteLayer(const DamagedTable& table);
  absl::Status WriteRows(const DamagedTable& table);
  // Fetches a row that can't be read, an object by its id or a tile by its place. Notes it as
  // fetched or lost.
  absl::Status Fetch(const StoredLayer& layer, int64_t id, int64_t first, int64_t second,
                     FetchReport::Layer* fetched);
  // The layer in the source; null if it is not there, or another one.
  const StoredLayer* FindInSource(const StoredLayer& layer) const;

  KnownFile damaged_;
  KnownFile source_;
  const std::string fresh_;
  std::vector<DamagedTable> tables_;
  std::unique_ptr<Database> database_;  // the new file
  std::vector<FetchReport::Layer> fetched_;
  std::vector<std::string> lost_;
};

absl::Status MapFetcher::FindDamagedLayers() {
  for (const StoredLayer& layer : damaged_.layers) {
    HYPERMAP_ASSIGN_OR_RETURN(std::optional<DamagedTable> table,
                              FindDamage(damaged_.database.get(), layer));
    if (table) tables_.push_back(*std::move(table));
  }
  return absl::OkStatus();
}

absl::Status MapFetcher::WriteOthers(const std::string& work) {
  {
    HYPERMAP_ASSIGN_OR_RETURN(
        const std::unique_ptr<Database> database,
        Database::Open(work, Database::OpenMode::kExisting, GeoPackageOptions().busy_timeout));
    // The pages of these tables, which can't all be read, belong to nothing then.
    sqlite3_db_config(database->handle(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
    HYPERMAP_RETURN_IF_ERROR(database->Execute("PRAGMA writable_schema = ON"));
    for (const DamagedTable& table : tables_) {
      HYPERMAP_RETURN_IF_ERROR(database->Execute(ForTable(kForget, table.layer.table)));
    }
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::unique_ptr<Database> database,
      Database::Open(work, Database::OpenMode::kExisting, GeoPackageOptions().busy_timeout));
  const absl::Status status = database->Run("VACUUM INTO ?", fresh_);
  if (!absl::IsDataLoss(status)) return status;
  return absl::FailedPreconditionError(
      absl::StrCat("more is damaged than layers, so that only a backup helps: ", status.message()));
}

absl::StatusOr<std::vector<MapFetcher::Part>> MapFetcher::PartsOf(const std::string& table) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, damaged_.database->Prepare(ForTable(kParts, table)));
  std::vector<Part> parts;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return parts;
    parts.push_back({std::string(select.Text(0)), std::string(select.Text(1))});
  }
}

absl::Status MapFetcher::Attach() {
  HYPERMAP_ASSIGN_OR_RETURN(database_, Database::Open(fresh_, Database::OpenMode::kExisting,
                                                      GeoPackageOptions().busy_timeout));
  HYPERMAP_RETURN_IF_ERROR(RegisterSpatialFunctions(database_.get()));
  HYPERMAP_RETURN_IF_ERROR(
      database_->Execute("PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF"));
  HYPERMAP_RETURN_IF_ERROR(database_->Run("ATTACH ? AS damaged", damaged_.database->path()));
  return database_->Run("ATTACH ? AS source", source_.database->path());
}

const StoredLayer* MapFetcher::FindInSource(const StoredLayer& layer) const {
  for (const StoredLayer& other : source_.layers) {
    const LayerSpec& spec = other.spec;
    if (spec.name != layer.spec.name || spec.kind != layer.spec.kind) continue;
    return spec.grid == layer.spec.grid && spec.frame_id == layer.spec.frame_id ? &other : nullptr;
  }
  return nullptr;
}

absl::Status MapFetcher::WriteRows(const DamagedTable& table) {
  const StoredLayer& layer = table.layer;
  const std::string copy = ForTable(kCopyRow, layer.table);
  const std::string select =
      absl::StrReplaceAll(IsGridKind(layer.spec.kind) ? kTileIds : kObjectIds,
                          {{"$i", table.lacks_rows ? IndexOf(layer) : "NOT INDEXED"}});
  HYPERMAP_ASSIGN_OR_RETURN(Statement ids, database_->Prepare(ForTable(select, layer.table)));
  FetchReport::Layer fetched{layer.spec.name, {}};
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, ids.Step());
    if (!has_row) break;
    const int64_t id = ids.Int64(0);
    absl::Status copied = absl::DataLossError("invalid");
    if (!table.invalid.contains(id)) copied = database_->Run(copy, id);
    if (copied.ok()) continue;
    if (!absl::IsDataLoss(copied)) return copied;
    HYPERMAP_RETURN_IF_ERROR(Fetch(layer, id, ids.Int64(1), ids.Int64(2), &fetched));
  }
  if (!fetched.rows.empty()) fetched_.push_back(std::move(fetched));
  return absl::OkStatus();
}

absl::Status MapFetcher::Fetch(const StoredLayer& layer, int64_t id, int64_t first, int64_t second,
                               FetchReport::Layer* fetched) {
  const bool is_grid = IsGridKind(layer.spec.kind);
  std::string name = absl::StrCat("object ", id);
  if (is_grid) {
    const TileIndex tile = FromMatrix({first, second});
    name = absl::StrCat("tile (", tile.row, ", ", tile.col, ")");
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> num_changes,
      database_->QueryInt64(is_grid ? kTileChanged : kObjectChanged, layer.lineage,
                            source_.metadata.revision, first, second));
  const StoredLayer* const in_source = FindInSource(layer);
  absl::string_view why = " is not in the copy";
  if (num_changes != 0) {
    why = " was changed after the copy was made";
  } else if (in_source != nullptr) {
    const std::string fetch = absl::StrReplaceAll(is_grid ? kFetchTile : kFetchObject,
                                                  {{"$t", layer.table}, {"$s", in_source->table}});
    const absl::Status status = database_->Run(fetch, first, second, layer.lineage, id);
    if (!status.ok() && !absl::IsDataLoss(status)) return status;
    if (status.ok() && database_->changed_rows() == 1) {
      fetched->rows.push_back(std::move(name));
      return absl::OkStatus();
    }
    if (!status.ok()) why = " can't be read in the copy either";
  }
  lost_.push_back(absl::StrCat(name, " of layer ", layer.spec.name, why));
  return absl::OkStatus();
}

absl::Status MapFetcher::WriteLayer(const DamagedTable& table) {
  const StoredLayer& layer = table.layer;
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Part> parts, PartsOf(layer.table));
  for (const Part& part : parts) {
    if (part.type == "table") HYPERMAP_RETURN_IF_ERROR(database_->Execute(part.sql));
  }
  const absl::Status status = WriteRows(table);
  if (absl::IsDataLoss(status)) {
    return absl::FailedPreconditionError(absl::StrCat(
        "both the table of layer ", layer.spec.name,
        " and its index are damaged, so that only a backup helps: ", status.message()));
  }
  HYPERMAP_RETURN_IF_ERROR(status);
  if (!IsGridKind(layer.spec.kind)) {
    HYPERMAP_RETURN_IF_ERROR(database_->Execute(ForTable(kFillIndexOfPlaces, layer.table)));
  }
  // Last, so that triggers do not see the rows.
  for (const Part& part : parts) {
    if (part.type != "table") HYPERMAP_RETURN_IF_ERROR(database_->Execute(part.sql));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<FetchReport::Layer>> MapFetcher::Write(const std::string& work) {
  HYPERMAP_RETURN_IF_ERROR(FindDamagedLayers());
  HYPERMAP_RETURN_IF_ERROR(WriteOthers(work));
  HYPERMAP_RETURN_IF_ERROR(Attach());
  for (const DamagedTable& table : tables_) HYPERMAP_RETURN_IF_ERROR(WriteLayer(table));
  HYPERMAP_RETURN_IF_ERROR(RecordCopy(database_.get()));
  if (lost_.empty()) return std::move(fetched_);
  const size_t num_lost = lost_.size();
  if (num_lost > kMaxNamed) lost_.resize(kMaxNamed);
  return absl::FailedPreconditionError(absl::StrCat(num_lost, num_lost == 1 ? " row" : " rows",
                                                    " would be lost: ", absl::StrJoin(lost_, "; "),
                                                    num_lost > kMaxNamed ? "; …" : ""));
}

std::string NewPathOf(const std::string& path) { return path + ".new"; }
std::string WorkPathOf(const std::string& path) { return path + ".work"; }

// Writes the repaired file as NewPathOf, from CopyPathOf and `source`.
absl::StatusOr<FetchReport> WriteRepaired(const std::string& path, const std::string& source,
                                          const EvidenceCheck& evidence) {
  HYPERMAP_RETURN_IF_ERROR(RemoveMapFile(WorkPathOf(path)));
  HYPERMAP_RETURN_IF_ERROR(RemoveMapFile(NewPathOf(path)));
  HYPERMAP_RETURN_IF_ERROR(CopyMapFile(path, WorkPathOf(path)));
  FetchReport report;
  {
    HYPERMAP_ASSIGN_OR_RETURN(KnownFile damaged, OpenToRead(CopyPathOf(path)));
    absl::StatusOr<KnownFile> other = OpenToRead(source);
    const absl::Status fits = other.ok() ? CheckSameMap(damaged, *other) : other.status();
    if (!fits.ok()) return absl::Status(fits.code(), absl::StrCat(source, ": ", fits.message()));
    MapFetcher fetcher(std::move(damaged), *std::move(other), NewPathOf(path));
    HYPERMAP_ASSIGN_OR_RETURN(report.layers, fetcher.Write(WorkPathOf(path)));
  }
  HYPERMAP_ASSIGN_OR_RETURN(report.after, CheckMapFile(NewPathOf(path), evidence));
  if (report.after.findings.empty()) return report;
  const Finding& finding = report.after.findings.front();
  return absl::FailedPreconditionError(
      absl::StrCat("the repaired file would not be whole: ", finding.table, " ", finding.row, ": ",
                   finding.problem));
}

// Puts the repaired file in the place of the damaged one. It has what was in the log, which must
// not be applied to it.
absl::Status PutInPlace(const std::string& path) {
  HYPERMAP_RETURN_IF_ERROR(RemoveSidecars(path));
  return ReplaceFile(NewPathOf(path), path);
}

}  // namespace

absl::StatusOr<FetchReport> FetchDamaged(const std::string& path, const std::string& source,
                                         const EvidenceCheck& evidence) {
  if (!PathExists(path)) return absl::NotFoundError("there is no such file");
  if (!PathExists(source)) return absl::NotFoundError(absl::StrCat(source, " does not exist"));
  if (WasWrittenByOthers(path)) {
    return absl::FailedPreconditionError(
        "another program has written to the file, so that its checksums do not tell what is "
        "damaged");
  }
  HYPERMAP_RETURN_IF_ERROR(SaveMapCopy(path));
  absl::StatusOr<FetchReport> report = WriteRepaired(path, source, evidence);
  RemoveMapFile(WorkPathOf(path)).IgnoreError();
  if (!report.ok()) {
    RemoveMapFile(NewPathOf(path)).IgnoreError();
    RemoveMapFile(CopyPathOf(path)).IgnoreError();
    return report;
  }
  report->copy = CopyPathOf(path);
  const absl::Status status = PutInPlace(path);
  if (status.ok()) return report;
  // The log may be gone already, and with it commits that only the copy has.
  return absl::Status(status.code(),
                      absl::StrCat(status.message(), "; the file as it was is ", report->copy));
}

}  // namespace hypermap::storage
