#include "storage/geopackage/feature_table.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "storage/encoding/object_columns.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/object_row.h"
#include "storage/geopackage/packed_index.h"

namespace hypermap::storage {
namespace {

// $t stands for the table's name, which needs no escapes (IsLayerTableName), $g for the type of its
// geometries.
constexpr char kCreateFeatureTable[] = R"sql(
CREATE TABLE "$t" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom $g NOT NULL,
  label TEXT NOT NULL,
  existence DOUBLE NOT NULL DEFAULT 1.0,
  classes TEXT NOT NULL DEFAULT '{}',
  tags TEXT NOT NULL DEFAULT '[]',
  attributes TEXT NOT NULL DEFAULT '{}',
  height_min DOUBLE,
  height_max DOUBLE,
  version INTEGER NOT NULL DEFAULT 0,
  expires_at_ns INTEGER
);
CREATE INDEX "hypermap_$t_label" ON "$t" (label);
)sql";

// OGC 12-128r17, annex F.3, word for word.
constexpr char kCreateIndex[] = R"sql(
CREATE VIRTUAL TABLE "rtree_$t_geom" USING rtree(id, minx, maxx, miny, maxy);
CREATE TRIGGER "rtree_$t_geom_insert" AFTER INSERT ON "$t"
  WHEN (new."geom" NOT NULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_$t_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_$t_geom_update1" AFTER UPDATE OF "geom" ON "$t"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  INSERT OR REPLACE INTO "rtree_$t_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_$t_geom_update2" AFTER UPDATE OF "geom" ON "$t"
  WHEN OLD."id" = NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_$t_geom" WHERE id = OLD."id";
END;
CREATE TRIGGER "rtree_$t_geom_update3" AFTER UPDATE ON "$t"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" NOTNULL AND NOT ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_$t_geom" WHERE id = OLD."id";
  INSERT OR REPLACE INTO "rtree_$t_geom" VALUES (
    NEW."id",
    ST_MinX(NEW."geom"), ST_MaxX(NEW."geom"),
    ST_MinY(NEW."geom"), ST_MaxY(NEW."geom")
  );
END;
CREATE TRIGGER "rtree_$t_geom_update4" AFTER UPDATE ON "$t"
  WHEN OLD."id" != NEW."id" AND
       (NEW."geom" ISNULL OR ST_IsEmpty(NEW."geom"))
BEGIN
  DELETE FROM "rtree_$t_geom" WHERE id IN (OLD."id", NEW."id");
END;
CREATE TRIGGER "rtree_$t_geom_delete" AFTER DELETE ON "$t"
  WHEN old."geom" NOT NULL
BEGIN
  DELETE FROM "rtree_$t_geom" WHERE id = OLD."id";
END;
)sql";

constexpr char kInsert[] = R"sql(
INSERT INTO "$t" (geom, label, existence, classes, tags, attributes, height_min, height_max,
  expires_at_ns, version, id) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)
)sql";
constexpr char kUpdate[] = R"sql(
UPDATE "$t" SET geom = ?, label = ?, existence = ?, classes = ?, tags = ?, attributes = ?,
  height_min = ?, height_max = ?, expires_at_ns = ?, version = ? WHERE id = ?
)sql";
// The statement does not name the geometry, so that it runs no trigger of the index.
constexpr char kUpdateWithoutGeometry[] = R"sql(
UPDATE "$t" SET label = ?, existence = ?, classes = ?, tags = ?, attributes = ?,
  height_min = ?, height_max = ?, expires_at_ns = ?, version = ? WHERE id = ?
)sql";
constexpr char kArchive[] = R"sql(
INSERT INTO hypermap_object_history (lineage, object_id, first_revision, end_revision, $columns)
  SELECT ?1, id, version, ?2, $columns FROM "$t" WHERE id = ?3
  RETURNING id, first_revision, geom
)sql";
constexpr char kHasOtherTriggers[] = R"sql(
SELECT EXISTS (SELECT 1 FROM sqlite_master
  WHERE type = 'trigger' AND lower(tbl_name) = lower('$t') AND name NOT IN (
    'rtree_$t_geom_insert', 'rtree_$t_geom_update1', 'rtree_$t_geom_update2',
    'rtree_$t_geom_update3', 'rtree_$t_geom_update4', 'rtree_$t_geom_delete',
    'hypermap_$t_insert', 'hypermap_$t_update', 'hypermap_$t_delete'))
)sql";
constexpr char kInsertBox[] = R"sql(
INSERT OR REPLACE INTO "rtree_$t_geom" VALUES (?, ?, ?, ?, ?)
)sql";
// From this number of new objects on, the triggers are disabled and the index is filled after the
// table.
constexpr size_t kManyObjects = 512;

// Disables the triggers of a connection while it lives, and lets its statements write to the tables
// of an R*Tree. SQLite prepares all statements anew before and after.
class WithoutTriggers {
 public:
  explicit WithoutTriggers(Database* database) : handle_(database->handle()) { Set(false); }
  ~WithoutTriggers() { Set(true); }
  WithoutTriggers(const WithoutTriggers&) = delete;
  WithoutTriggers& operator=(const WithoutTriggers&) = delete;

 private:
  void Set(bool usual) {
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_ENABLE_TRIGGER, usual ? 1 : 0, nullptr);
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, usual ? 1 : 0, nullptr);
  }

  sqlite3* handle_;
};

std::vector<IndexCell> CellsOf(absl::Span<const SemanticObject* const> objects) {
  std::vector<IndexCell> cells;
  cells.reserve(objects.size());
  for (const SemanticObject* object : objects) {
    cells.push_back(IndexCell::Of(object->id, object->shape.bounds()));
  }
  return cells;
}

}  // namespace

FeatureTable::FeatureTable(Database* database, std::string table, int64_t lineage,
                           const ShapeKinds& shape_kinds)
    : database_(database),
      table_(std::move(table)),
      lineage_(lineage),
      shape_kinds_(shape_kinds),
      insert_sql_(ForTable(kInsert, table_)),
      update_sql_(ForTable(kUpdate, table_)),
      update_without_geometry_sql_(ForTable(kUpdateWithoutGeometry, table_)),
      archive_sql_(absl::StrReplaceAll(kArchive, {{"$t", table_}, {"$columns", kObjectColumns}})),
      delete_sql_(ForTable(R"sql(DELETE FROM "$t" WHERE id = ?)sql", table_)) {}

absl::Status FeatureTable::Create() {
  HYPERMAP_RETURN_IF_ERROR(database_->Execute(
      absl::StrReplaceAll(absl::StrCat(kCreateFeatureTable, kCreateIndex),
                          {{"$t", table_}, {"$g", GeometryTypeName(shape_kinds_)}})));
  return WatchForForeignWrites(database_, table_);
}

absl::Status FeatureTable::Drop(Revision revision) {
  HYPERMAP_RETURN_IF_ERROR(ArchiveAll(revision));
  // Cached statements would keep resources of the dropped table.
  database_->ForgetStatements();
  return database_->Execute(
      ForTable(R"sql(DROP TABLE "rtree_$t_geom"; DROP TABLE "$t")sql", table_));
}

absl::StatusOr<bool> FeatureTable::Archive(ObjectId id, Revision end_revision) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement archive, database_->Prepare(archive_sql_));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, archive.Bind(lineage_, end_revision, id).Step());
  if (!has_row) return false;
  const int64_t history_id = archive.Int64(0);
  const VersionBox box =
      BoxOfVersion(archive.Blob(2), /*first_revision=*/archive.Int64(1), end_revision, lineage_);
  HYPERMAP_RETURN_IF_ERROR(archive.Run());
  HYPERMAP_RETURN_IF_ERROR(InsertVersionBox(database_, history_id, box));
  return true;
}

absl::Status FeatureTable::ArchiveAll(Revision end_revision) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(ForTable(R"sql(SELECT id FROM "$t" ORDER BY id)sql", table_)));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    HYPERMAP_RETURN_IF_ERROR(Archive(select.Int64(0), end_revision).status());
  }
}

absl::Status FeatureTable::Put(const SemanticObject& object, const SemanticObject* before,
                               Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(const EncodedObject columns, EncodeObject(object));
  // A replica writes the changes of several revisions in one commit, with their own versions.
  const Revision version = object.version > 0 ? object.version : revision;
  const auto write = [&](const std::string& sql) {
    return database_->Run(sql, BlobView{columns.shape}, object.label, object.existence,
                          columns.classes, columns.tags, columns.attributes, columns.height_min,
                          columns.height_max, columns.expires_at_ns, version, object.id);
  };
  absl::Status inserted;
  if (before == nullptr) {
    inserted = write(insert_sql_);
    if (inserted.code() != absl::StatusCode::kInternal) return inserted;
  }
  // An upsert is not possible: its conflict policy would override that of the standard triggers.
  HYPERMAP_ASSIGN_OR_RETURN(const bool was_there, Archive(object.id, revision));
  if (!was_there && before == nullptr) return inserted;
  if (before == nullptr || before->shape != object.shape) return write(update_sql_);
  return database_->Run(update_without_geometry_sql_, object.label, object.existence,
                        columns.classes, columns.tags, columns.attributes, columns.height_min,
                        columns.height_max, columns.expires_at_ns, version, object.id);
}

absl::Status FeatureTable::PutNew(absl::Span<const SemanticObject* const> objects,
                                  Revision revision) {
  if (objects.size() < kManyObjects) return PutSorted(objects, revision);
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> has_other_triggers,
                            database_->QueryInt64(ForTable(kHasOtherTriggers, table_)));
  if (has_other_triggers.value_or(1) != 0) return PutSorted(objects, revision);

  const WithoutTriggers here(database_);
  for (const SemanticObject* object : objects) {
    HYPERMAP_RETURN_IF_ERROR(Put(*object, nullptr, revision));
  }
  return FillIndex(CellsOf(objects));
}

// Most of the time goes to updating the index, which is faster if objects that are near each other
// are written one after the other.
absl::Status FeatureTable::PutSorted(absl::Span<const SemanticObject* const> objects,
                                     Revision revision) {
  std::vector<IndexCell> cells = CellsOf(objects);
  for (size_t i = 0; i < cells.size(); ++i) cells[i].id = static_cast<int64_t>(i);
  SortInSpace(&cells);
  for (const IndexCell& cell : cells) {
    HYPERMAP_RETURN_IF_ERROR(Put(*objects[static_cast<size_t>(cell.id)], nullptr, revision));
  }
  return absl::OkStatus();
}

absl::Status FeatureTable::FillIndex(std::vector<IndexCell> cells) {
  const std::string tree = ForTable("rtree_$t_geom", table_);
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_new, IsNewTree(database_, tree));
  if (is_new) return PackTree(database_, tree, std::move(cells));
  SortInSpace(&cells);
  HYPERMAP_ASSIGN_OR_RETURN(Statement insert, database_->Prepare(ForTable(kInsertBox, table_)));
  for (const auto& [id, box] : cells) {
    insert.Bind(id, double{box[0]}, double{box[1]}, double{box[2]}, double{box[3]});
    HYPERMAP_RETURN_IF_ERROR(insert.Run());
  }
  return absl::OkStatus();
}

absl::Status FeatureTable::Remove(ObjectId id, Revision revision) {
  HYPERMAP_RETURN_IF_ERROR(Archive(id, revision).status());
  return database_->Run(delete_sql_, id);
}

absl::Status FeatureTable::CheckKind(const Shape& shape) const {
  if (shape_kinds_.Contains(shape.kind())) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("the layer takes no shapes of the kind ", ShapeKindName(shape.kind())));
}

absl::Status FeatureTable::ForEach(Visit visit) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                            database_->Prepare(absl::StrReplaceAll(
                                R"sql(SELECT id, $columns, version FROM "$t" ORDER BY id)sql",
                                {{"$t", table_}, {"$columns", kObjectColumns}})));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    absl::StatusOr<ObjectPtr> object = ReadObjectRow(&select);
    absl::Status status = object.status();
    if (status.ok()) status = CheckKind((*object)->shape);
    if (!status.ok()) object = absl::DataLossError(status.message());
    HYPERMAP_RETURN_IF_ERROR(visit(select.Int64(0), std::move(object)));
  }
}

absl::StatusOr<std::vector<ObjectPtr>> FeatureTable::ReadAll() {
  std::vector<ObjectPtr> objects;
  const absl::Status status =
      ForEach([&](ObjectId id, absl::StatusOr<ObjectPtr> object) -> absl::Status {
        if (!object.ok()) {
          return absl::DataLossError(
              absl::StrCat("table ", table_, ", id ", id, ": ", object.status().message()));
        }
        objects.push_back(*std::move(object));
        return absl::OkStatus();
      });
  HYPERMAP_RETURN_IF_ERROR(status);
  return objects;
}

}  // namespace hypermap::storage
