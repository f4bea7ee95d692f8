#include "storage/geopackage/object_versions.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/edits/byte_size.h"
#include "storage/geopackage/history_tables.h"
#include "storage/geopackage/object_row.h"

namespace hypermap::storage {
namespace {

constexpr char kHistoryTable[] = "hypermap_object_history";

// $columns stands for the columns of an object, $t for the name of the layer's table, which needs
// no escapes (IsLayerTableName).
constexpr char kReplacedAt[] = R"sql(
SELECT object_id, $columns, first_revision FROM hypermap_object_history
  WHERE lineage = ?1 AND object_id = ?2 AND end_revision > ?3 ORDER BY end_revision LIMIT 1
)sql";
constexpr char kCurrentAt[] = R"sql(
SELECT id, $columns, version FROM "$t" WHERE id = ?1 AND version <= ?2
)sql";

// One scan of the R*Tree, of which the revision and the lineage are two axes. The tree clamps its
// values to 32 bits, so that the exact columns are compared as well.
constexpr char kReplacedInBox[] = R"sql(
SELECT h.object_id, $columns, h.first_revision
  FROM hypermap_object_boxes AS b CROSS JOIN hypermap_object_history AS h ON h.id = b.id
  WHERE b.first_revision <= ?3 AND b.last_revision >= ?3
    AND b.min_lineage = ?4
    AND b.max_x >= ?5 AND b.min_x <= ?6 AND b.max_y >= ?7 AND b.min_y <= ?8
    AND h.lineage = ?1 AND h.first_revision <= ?2 AND h.end_revision > ?2
)sql";
constexpr char kCurrentInBox[] = R"sql(
SELECT f.id, $columns, f.version
  FROM "rtree_$t_geom" AS b CROSS JOIN "$t" AS f ON f.id = b.id
  WHERE b.maxx >= ?2 AND b.minx <= ?3 AND b.maxy >= ?4 AND b.miny <= ?5 AND f.version <= ?1
)sql";

constexpr char kAllReplaced[] = R"sql(
SELECT h.object_id, $columns, h.first_revision
  FROM hypermap_object_boxes AS b CROSS JOIN hypermap_object_history AS h ON h.id = b.id
  WHERE b.first_revision <= ?3 AND b.last_revision >= ?3
    AND b.min_lineage = ?4
    AND h.lineage = ?1 AND h.first_revision <= ?2 AND h.end_revision > ?2
)sql";
constexpr char kAllCurrent[] = R"sql(
SELECT id, $columns, version FROM "$t" WHERE version <= ?1
)sql";

std::string Filled(absl::string_view sql, const std::string& table = "") {
  return absl::StrReplaceAll(sql, {{"$columns", kObjectColumns}, {"$t", table}});
}

void SortById(std::vector<ObjectPtr>* objects) {
  std::sort(objects->begin(), objects->end(),
            [](const ObjectPtr& a, const ObjectPtr& b) { return a->id < b->id; });
}

}  // namespace

ObjectVersions::ObjectVersions(Database* database, CacheRoomPtr room)
    : database_(database),
      replaced_at_(Filled(kReplacedAt)),
      replaced_in_box_(Filled(kReplacedInBox)),
      all_replaced_(Filled(kAllReplaced)),
      cache_(std::move(room)) {}

absl::StatusOr<ObjectPtr> ObjectVersions::Read(Statement* row, const std::string& table,
                                               int64_t lineage) {
  const Key key{lineage, row->Int64(kObjectIdColumn), row->Int64(kObjectVersionColumn)};
  if (ObjectPtr known = cache_.Find(key)) {
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfPlaces + ByteSize(*known)));
    return known;
  }
  absl::StatusOr<ObjectPtr> object = ReadObjectRow(row);
  if (!object.ok()) {
    return absl::DataLossError(absl::StrCat("table ", table, ", object ", std::get<1>(key),
                                            ", version ", std::get<2>(key), ": ",
                                            object.status().message()));
  }
  const int64_t bytes = kBytesOfPlaces + ByteSize(**object);
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(bytes));
  cache_.Insert(key, *object, bytes);
  return object;
}

absl::Status ObjectVersions::ReadAll(Statement* select, const std::string& table, int64_t lineage,
                                     std::vector<ObjectPtr>* objects) {
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select->Step());
    if (!has_row) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(ObjectPtr object, Read(select, table, lineage));
    objects->push_back(std::move(object));
  }
}

absl::StatusOr<ObjectPtr> ObjectVersions::At(const Lineage& layer, ObjectId id, Revision revision) {
  const auto& [stored, is_current] = layer;
  HYPERMAP_ASSIGN_OR_RETURN(Statement replaced, database_->Prepare(replaced_at_));
  absl::StatusOr<bool> row = replaced.Bind(stored.lineage, id, revision).Step();
  HYPERMAP_RETURN_IF_ERROR(row.status());
  if (*row) {
    if (replaced.Int64(kObjectVersionColumn) > revision) return ObjectPtr();
    return Read(&replaced, kHistoryTable, stored.lineage);
  }
  if (!is_current) return ObjectPtr();
  HYPERMAP_ASSIGN_OR_RETURN(Statement current,
                            database_->Prepare(Filled(kCurrentAt, stored.table)));
  row = current.Bind(id, revision).Step();
  HYPERMAP_RETURN_IF_ERROR(row.status());
  if (!*row) return ObjectPtr();
  return Read(&current, stored.table, stored.lineage);
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::InBox(const Lineage& layer, const Box& box,
                                                             Revision revision) {
  const auto& [stored, is_current] = layer;
  std::vector<ObjectPtr> objects;
  if (box.empty()) return objects;
  HYPERMAP_ASSIGN_OR_RETURN(Statement replaced, database_->Prepare(replaced_in_box_));
  const MillimetreBox mm = ToMillimetres(box);
  replaced.Bind(stored.lineage, revision, ClampToInt32(revision), ClampToInt32(stored.lineage),
                mm.min_x, mm.max_x, mm.min_y, mm.max_y);
  HYPERMAP_RETURN_IF_ERROR(ReadAll(&replaced, kHistoryTable, stored.lineage, &objects));
  if (is_current) {
    HYPERMAP_ASSIGN_OR_RETURN(Statement current,
                              database_->Prepare(Filled(kCurrentInBox, stored.table)));
    current.Bind(revision, box.min.x, box.max.x, box.min.y, box.max.y);
    HYPERMAP_RETURN_IF_ERROR(ReadAll(&current, stored.table, stored.lineage, &objects));
  }
  SortById(&objects);
  return objects;
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::All(const Lineage& layer,
                                                           Revision revision) {
  const auto& [stored, is_current] = layer;
  std::vector<ObjectPtr> objects;
  HYPERMAP_ASSIGN_OR_RETURN(Statement replaced, database_->Prepare(all_replaced_));
  replaced.Bind(stored.lineage, revision, ClampToInt32(revision), ClampToInt32(stored.lineage));
  HYPERMAP_RETURN_IF_ERROR(ReadAll(&replaced, kHistoryTable, stored.lineage, &objects));
  if (is_current) {
    HYPERMAP_ASSIGN_OR_RETURN(Statement current,
                              database_->Prepare(Filled(kAllCurrent, stored.table)));
    current.Bind(revision);
    HYPERMAP_RETURN_IF_ERROR(ReadAll(&current, stored.table, stored.lineage, &objects));
  }
  SortById(&objects);
  return objects;
}

}  // namespace hypermap::storage
