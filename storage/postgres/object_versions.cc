#include "storage/postgres/object_versions.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "storage/postgres/object_row.h"

namespace hypermap::storage::postgres {
namespace {

// $bytes stands for kObjectBytes. The operators of boxes take coordinates as equal that differ by
// at most 1e-6, so that they find some objects near the box, but miss none.
constexpr char kObjectsInBox[] = R"sql(
SELECT object_id, first_revision, end_revision, $bytes FROM hypermap.objects
  WHERE map + 0 = $1 AND lineage + 0 = $2 AND bounds && box(point($3, $4), point($5, $6))
    AND int8range(first_revision, end_revision) @> $7 AND object_id > $8
  ORDER BY object_id LIMIT $9
)sql";

// $columns stands for kObjectColumns. The lateral query, with its limit, is run for each version:
// the planner can't choose to read the whole table instead.
constexpr char kFetchObjects[] = R"sql(
SELECT v.number, o.*
  FROM unnest($2::int8[], $3::int8[], $4::int8[]) WITH ORDINALITY
    AS v(lineage, object_id, end_revision, number)
  CROSS JOIN LATERAL (
    SELECT $columns FROM hypermap.objects
      WHERE map = $1 AND lineage = v.lineage AND object_id = v.object_id
        AND end_revision = v.end_revision LIMIT 1) AS o
)sql";

// Versions that are found with one statement: some megabytes.
constexpr int64_t kVersionsPerPage = 65536;

}  // namespace

std::string ObjectVersion::Name() const {
  return absl::StrCat("hypermap.objects, lineage ", lineage, ", object ", id, ", version ",
                      first_revision);
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::InBox(Connection& connection,
                                                             int64_t lineage, const Box& box,
                                                             Revision revision) {
  std::vector<ObjectPtr> objects;
  if (box.empty()) return objects;
  const std::string sql = absl::StrReplaceAll(kObjectsInBox, {{"$bytes", kObjectBytes}});
  std::vector<ObjectVersion> page;
  ObjectId last = 0;
  do {
    page.clear();
    HYPERMAP_ASSIGN_OR_RETURN(
        Rows rows, connection.Query(sql, map_, lineage, box.min.x, box.min.y, box.max.x, box.max.y,
                                    revision, last, kVersionsPerPage));
    while (rows.Next()) {
      last = rows.Int64(0);
      page.push_back({lineage, last, rows.Int64(1), rows.Int64(2), rows.Int64(3)});
    }
    HYPERMAP_RETURN_IF_ERROR(rows.row_status());
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObjectPtr> read, Read(connection, page));
    objects.insert(objects.end(), read.begin(), read.end());
  } while (page.size() == kVersionsPerPage);
  return objects;
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::Read(
    Connection& connection, absl::Span<const ObjectVersion> versions) {
  using Cache = VersionCache<ObjectVersion, ObjectPtr>;
  const std::string sql = absl::StrReplaceAll(kFetchObjects, {{"$columns", kObjectColumns}});
  return cache_.Read(
      versions, [&](absl::Span<const ObjectVersion> batch, Cache::Take take) -> absl::Status {
        std::vector<int64_t> lineages, ids, ends;
        for (const ObjectVersion& version : batch) {
          lineages.push_back(version.lineage);
          ids.push_back(version.id);
          ends.push_back(version.end_revision);
        }
        HYPERMAP_ASSIGN_OR_RETURN(
            Rows rows, connection.Query(sql, map_, absl::MakeConstSpan(lineages),
                                        absl::MakeConstSpan(ids), absl::MakeConstSpan(ends)));
        while (rows.Next()) {
          const size_t number = static_cast<size_t>(rows.Int64(0) - 1);
          HYPERMAP_RETURN_IF_ERROR(take(number, ReadObjectRow(&rows, 1)));
        }
        return rows.row_status();
      });
}

}  // namespace hypermap::storage::postgres
