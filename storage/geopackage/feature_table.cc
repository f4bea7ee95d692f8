#include "storage/geopackage/feature_table.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/geometry_blob.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/object_row.h"
#include "storage/geopackage/packed_index.h"

namespace hypermap::storage {
namespace {

// $t stands for the table's name, which is plain (IsLayerTableName).
constexpr char kCreateTable[] = R"sql(
CREATE TABLE "$t" (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  geom POLYGON NOT NULL,
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

std::string ForTable(absl::string_view sql, const std::string& table) {
  return absl::StrReplaceAll(sql, {{"$t", table}});
}

constexpr char kInsert[] = R"sql(
INSERT INTO "$t" (geom, label, existence, classes, tags, attributes, height_min, height_max,
  expires_at_ns, version, id) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)
)sql";
constexpr char kUpdate[] = R"sql(
UPDATE "$t" SET geom = ?, label = ?, existence = ?, classes = ?, tags = ?, attributes = ?,
  height_min = ?, height_max = ?, expires_at_ns = ?, version = ? WHERE id = ?
)sql";
// The index has nothing to do with this one.
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
    'rtree_$t_geom_update3', 'rtree_$t_geom_update4', 'rtree_$t_geom_delete'))
)sql";
constexpr char kInsertBox[] = R"sql(
INSERT OR REPLACE INTO "rtree_$t_geom" VALUES (?, ?, ?, ?, ?)
)sql";
constexpr char kArchiveBox[] =
    "INSERT INTO hypermap_object_boxes VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)";

// For so many objects the triggers are not called, and the index is filled after the table.
constexpr size_t kManyObjects = 512;

// Lets the statements of a connection write to the tables of an R*Tree, and call no triggers. All
// of them are prepared anew before and after.
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

std::optional<int64_t> Nanoseconds(const std::optional<absl::Time>& time) {
  return time ? std::make_optional(absl::ToUnixNanos(*time)) : std::nullopt;
}

std::optional<double> LowEnd(const std::optional<HeightRange>& height) {
  return height ? std::make_optional(height->low_m) : std::nullopt;
}

std::optional<double> HighEnd(const std::optional<HeightRange>& height) {
  return height ? std::make_optional(height->high_m) : std::nullopt;
}

std::vector<IndexCell> CellsOf(absl::Span<const SemanticObject* const> objects) {
  std::vector<IndexCell> cells;
  cells.reserve(objects.size());
  for (const SemanticObject* object : objects) {
    cells.push_back(IndexCell::Of(object->id, object->polygon.bounds()));
  }
  return cells;
}

// A geometry that can't be read gets the box of all, so that whoever reads it is told.
Box BoxOrAll(absl::string_view geometry) {
  constexpr double kFar = 1e300;
  const absl::StatusOr<Box> box = BoxOfGeometryBlob(geometry);
  return box.ok() && !box->empty() ? *box : Box{{-kFar, -kFar}, {kFar, kFar}};
}

}  // namespace

FeatureTable::FeatureTable(Database* database, std::string table, int64_t lineage)
    : database_(database),
      table_(std::move(table)),
      lineage_(lineage),
      insert_sql_(ForTable(kInsert, table_)),
      update_sql_(ForTable(kUpdate, table_)),
      update_without_geometry_sql_(ForTable(kUpdateWithoutGeometry, table_)),
      archive_sql_(absl::StrReplaceAll(kArchive, {{"$t", table_}, {"$columns", kObjectColumns}})),
      delete_sql_(ForTable(R"sql(DELETE FROM "$t" WHERE id = ?)sql", table_)) {}

absl::Status FeatureTable::Create() {
  return database_->Execute(
      absl::StrCat(ForTable(kCreateTable, table_), ForTable(kCreateIndex, table_)));
}

absl::Status FeatureTable::Drop(Revision revision) {
  if (absl::Status status = ArchiveAll(revision); !status.ok()) return status;
  // Prepared statements would go on holding what belonged to the table.
  database_->ForgetStatements();
  return database_->Execute(
      ForTable(R"sql(DROP TABLE "rtree_$t_geom"; DROP TABLE "$t")sql", table_));
}

absl::StatusOr<bool> FeatureTable::Archive(ObjectId id, Revision end_revision) {
  absl::StatusOr<Statement> archive = database_->Prepare(archive_sql_);
  if (!archive.ok()) return archive.status();
  absl::StatusOr<bool> row = archive->Bind(lineage_, end_revision, id).Step();
  if (!row.ok() || !*row) return row;
  const int64_t history_id = archive->Int64(0);
  const Revision first_revision = archive->Int64(1);
  const MillimetreBox box = ToMillimetres(BoxOrAll(archive->Blob(2)));
  if (absl::Status status = archive->Run(); !status.ok()) return status;
  absl::Status status =
      database_->Run(kArchiveBox, history_id, box.min_x, box.max_x, box.min_y, box.max_y,
                     ClampToInt32(first_revision), ClampToInt32(end_revision - 1),
                     ClampToInt32(lineage_), ClampToInt32(lineage_ + 1));
  if (!status.ok()) return status;
  return true;
}

absl::Status FeatureTable::ArchiveAll(Revision end_revision) {
  absl::StatusOr<Statement> select =
      database_->Prepare(ForTable(R"sql(SELECT id FROM "$t" ORDER BY id)sql", table_));
  if (!select.ok()) return select.status();
  while (true) {
    absl::StatusOr<bool> row = select->Step();
    if (!row.ok()) return row.status();
    if (!*row) return absl::OkStatus();
    absl::StatusOr<bool> archived = Archive(select->Int64(0), end_revision);
    if (!archived.ok()) return archived.status();
  }
}

absl::Status FeatureTable::Put(const SemanticObject& object, const SemanticObject* before,
                               Revision revision) {
  absl::StatusOr<ObjectRow> row = EncodeObjectRow(object);
  if (!row.ok()) return row.status();
  // A copy of a map takes several revisions' changes at once.
  const Revision version = object.version > 0 ? object.version : revision;
  const auto write = [&](const std::string& sql) {
    return database_->Run(sql, BlobView{row->geometry}, object.label, object.existence,
                          row->classes, row->tags, row->attributes, LowEnd(object.height),
                          HighEnd(object.height), Nanoseconds(object.expires_at), version,
                          object.id);
  };
  absl::Status inserted;
  if (before == nullptr) {
    inserted = write(insert_sql_);
    if (inserted.code() != absl::StatusCode::kInternal) return inserted;
  }
  // No upsert: its conflict policy would override that of the standard triggers.
  absl::StatusOr<bool> was_there = Archive(object.id, revision);
  if (!was_there.ok()) return was_there.status();
  if (!*was_there && before == nullptr) return inserted;
  if (before == nullptr || before->polygon != object.polygon) return write(update_sql_);
  return database_->Run(update_without_geometry_sql_, object.label, object.existence, row->classes,
                        row->tags, row->attributes, LowEnd(object.height), HighEnd(object.height),
                        Nanoseconds(object.expires_at), version, object.id);
}

absl::Status FeatureTable::PutNew(absl::Span<const SemanticObject* const> objects,
                                  Revision revision) {
  if (objects.size() < kManyObjects) return PutSorted(objects, revision);
  const absl::StatusOr<std::optional<int64_t>> has_other_triggers =
      database_->QueryInt64(ForTable(kHasOtherTriggers, table_));
  if (!has_other_triggers.ok()) return has_other_triggers.status();
  if (has_other_triggers->value_or(1) != 0) return PutSorted(objects, revision);

  const WithoutTriggers here(database_);
  for (const SemanticObject* object : objects) {
    if (absl::Status status = Put(*object, nullptr, revision); !status.ok()) return status;
  }
  return FillIndex(CellsOf(objects));
}

// The index is by far the most of the work, and gets what is near each other one after another.
absl::Status FeatureTable::PutSorted(absl::Span<const SemanticObject* const> objects,
                                     Revision revision) {
  std::vector<IndexCell> cells = CellsOf(objects);
  for (size_t i = 0; i < cells.size(); ++i) cells[i].id = static_cast<int64_t>(i);
  SortInSpace(&cells);
  for (const IndexCell& cell : cells) {
    absl::Status status = Put(*objects[static_cast<size_t>(cell.id)], nullptr, revision);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status FeatureTable::FillIndex(std::vector<IndexCell> cells) {
  const std::string tree = ForTable("rtree_$t_geom", table_);
  const absl::StatusOr<bool> is_new = IsNewTree(database_, tree);
  if (!is_new.ok()) return is_new.status();
  if (*is_new) return PackTree(database_, tree, std::move(cells));
  SortInSpace(&cells);
  absl::StatusOr<Statement> insert = database_->Prepare(ForTable(kInsertBox, table_));
  if (!insert.ok()) return insert.status();
  for (const auto& [id, box] : cells) {
    insert->Bind(id, double{box[0]}, double{box[1]}, double{box[2]}, double{box[3]});
    if (absl::Status status = insert->Run(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status FeatureTable::Remove(ObjectId id, Revision revision) {
  absl::StatusOr<bool> was_there = Archive(id, revision);
  return was_there.ok() ? database_->Run(delete_sql_, id) : was_there.status();
}

absl::StatusOr<std::vector<ObjectPtr>> FeatureTable::ReadAll() {
  absl::StatusOr<Statement> select = database_->Prepare(
      absl::StrReplaceAll(R"sql(SELECT id, $columns, version FROM "$t" ORDER BY id)sql",
                          {{"$t", table_}, {"$columns", kObjectColumns}}));
  if (!select.ok()) return select.status();
  std::vector<ObjectPtr> objects;
  while (true) {
    absl::StatusOr<bool> row = select->Step();
    if (!row.ok()) return row.status();
    if (!*row) return objects;
    absl::StatusOr<ObjectPtr> object = ReadObjectRow(&*select);
    if (!object.ok()) {
      return absl::DataLossError(absl::StrCat("table ", table_, ", id ", select->Int64(0), ": ",
                                              object.status().message()));
    }
    objects.push_back(*std::move(object));
  }
}

}  // namespace hypermap::storage
