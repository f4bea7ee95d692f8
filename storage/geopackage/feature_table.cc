#include "storage/geopackage/feature_table.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "storage/geopackage/contents.h"
#include "storage/geopackage/geometry_blob.h"
#include "storage/geopackage/object_json.h"

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
  height_max DOUBLE
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

// The columns of an object that are not plain.
struct Encoded {
  std::string geometry;
  std::string classes;
  std::string tags;
  std::string attributes;
};

absl::StatusOr<Encoded> Encode(const SemanticObject& object) {
  absl::StatusOr<std::string> classes = EncodeClasses(object.classes);
  if (!classes.ok()) return classes.status();
  absl::StatusOr<std::string> tags = EncodeTags(object.tags);
  if (!tags.ok()) return tags.status();
  absl::StatusOr<std::string> attributes = EncodeAttributes(object.attributes);
  if (!attributes.ok()) return attributes.status();
  return Encoded{EncodeGeometryBlob(object.polygon), *std::move(classes), *std::move(tags),
                 *std::move(attributes)};
}

// Columns as in ReadAll; the id is column 0.
absl::StatusOr<ObjectPtr> ReadRow(Statement* row) {
  auto object = std::make_shared<SemanticObject>();
  object->id = row->Int64(0);
  const absl::string_view geometry = row->Blob(1);
  object->label = std::string(row->Text(2));
  object->existence = row->Double(3);
  const absl::string_view classes_json = row->Text(4);
  const absl::string_view tags_json = row->Text(5);
  const absl::string_view attributes_json = row->Text(6);
  const std::optional<double> height_min = row->OptionalDouble(7);
  const std::optional<double> height_max = row->OptionalDouble(8);
  if (!row->row_status().ok()) return row->row_status();

  absl::StatusOr<Polygon> polygon = DecodeGeometryBlob(geometry);
  if (!polygon.ok()) return polygon.status();
  object->polygon = *std::move(polygon);
  absl::StatusOr<Classes> classes = DecodeClasses(classes_json);
  if (!classes.ok()) return classes.status();
  object->classes = *std::move(classes);
  absl::StatusOr<Tags> tags = DecodeTags(tags_json);
  if (!tags.ok()) return tags.status();
  object->tags = *std::move(tags);
  absl::StatusOr<Attributes> attributes = DecodeAttributes(attributes_json);
  if (!attributes.ok()) return attributes.status();
  object->attributes = *std::move(attributes);
  if (height_min.has_value() != height_max.has_value()) {
    return absl::DataLossError("only one of height_min and height_max");
  }
  if (height_min) object->height = {*height_min, *height_max};
  if (object->id < 1) return absl::DataLossError("an id that is not positive");
  if (absl::Status status = Validate(*object); !status.ok()) return status;
  return object;
}

}  // namespace

FeatureTable::FeatureTable(Database* database, std::string table)
    : database_(database),
      table_(std::move(table)),
      insert_sql_(ForTable(R"sql(INSERT INTO "$t" (geom, label, existence, classes, tags,
          attributes, height_min, height_max, id) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?))sql",
                           table_)),
      update_sql_(ForTable(R"sql(UPDATE "$t" SET geom = ?, label = ?, existence = ?, classes = ?,
          tags = ?, attributes = ?, height_min = ?, height_max = ? WHERE id = ?)sql",
                           table_)),
      delete_sql_(ForTable(R"sql(DELETE FROM "$t" WHERE id = ?)sql", table_)) {}

absl::Status FeatureTable::Create() {
  return database_->Execute(
      absl::StrCat(ForTable(kCreateTable, table_), ForTable(kCreateIndex, table_)));
}

absl::Status FeatureTable::Drop() {
  // Prepared statements would go on holding what belonged to the table.
  database_->ForgetStatements();
  return database_->Execute(
      ForTable(R"sql(DROP TABLE "rtree_$t_geom"; DROP TABLE "$t")sql", table_));
}

absl::Status FeatureTable::Put(const SemanticObject& object) {
  absl::StatusOr<Encoded> encoded = Encode(object);
  if (!encoded.ok()) return encoded.status();
  std::optional<double> height_min;
  std::optional<double> height_max;
  if (object.height) {
    height_min = object.height->low_m;
    height_max = object.height->high_m;
  }
  const auto run = [&](const std::string& sql) {
    return database_->Run(sql, BlobView{encoded->geometry}, object.label, object.existence,
                          encoded->classes, encoded->tags, encoded->attributes, height_min,
                          height_max, object.id);
  };
  // No upsert: its conflict policy would override that of the standard triggers.
  if (absl::Status status = run(update_sql_); !status.ok()) return status;
  return database_->changed_rows() > 0 ? absl::OkStatus() : run(insert_sql_);
}

absl::Status FeatureTable::Remove(ObjectId id) { return database_->Run(delete_sql_, id); }

absl::StatusOr<std::vector<ObjectPtr>> FeatureTable::ReadAll() {
  absl::StatusOr<Statement> select =
      database_->Prepare(ForTable(R"sql(SELECT id, geom, label, existence, classes, tags,
          attributes, height_min, height_max FROM "$t" ORDER BY id)sql",
                                  table_));
  if (!select.ok()) return select.status();
  std::vector<ObjectPtr> objects;
  while (true) {
    absl::StatusOr<bool> row = select->Step();
    if (!row.ok()) return row.status();
    if (!*row) return objects;
    absl::StatusOr<ObjectPtr> object = ReadRow(&*select);
    if (!object.ok()) {
      return absl::DataLossError(absl::StrCat("table ", table_, ", id ", select->Int64(0), ": ",
                                              object.status().message()));
    }
    objects.push_back(*std::move(object));
  }
}

}  // namespace hypermap::storage
