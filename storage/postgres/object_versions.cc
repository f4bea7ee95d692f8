#include "storage/postgres/object_versions.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "storage/postgres/object_row.h"

namespace hypermap::storage::postgres {
namespace {

// $bytes stands for kObjectBytes, $columns for kObjectColumns: the content of the first objects,
// with up to $10 bytes together. The operators of boxes take coordinates as equal that differ by at
// most 1e-6, so that they find some objects near the box, but miss none.
constexpr char kObjectsInBox[] = R"sql(
SELECT s.object_id, s.first_revision, s.end_revision, s.bytes, o.*
  FROM (
    SELECT f.*, sum(f.bytes) OVER (ORDER BY f.object_id) <= $10 AS is_small
      FROM (
        SELECT *, $bytes AS bytes FROM hypermap.objects
          WHERE map + 0 = $1 AND lineage + 0 = $2 AND bounds && box(point($3, $4), point($5, $6))
            AND int8range(first_revision, end_revision) @> $7 AND object_id > $8
          ORDER BY object_id LIMIT $9) AS f) AS s
  LEFT JOIN LATERAL (SELECT $columns WHERE s.is_small) AS o ON true
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

// Versions that are found with one statement: some megabytes; and with the first one, of which
// there may be one for each layer at a time.
constexpr int64_t kVersionsPerPage = 65536;
constexpr int64_t kFirstPage = 1000;

}  // namespace

std::string ObjectVersion::Name() const {
  return absl::StrCat("hypermap.objects, lineage ", lineage, ", object ", id, ", version ",
                      first_revision);
}

void ObjectVersions::AskInBox(Pipeline& pipeline, int64_t lineage, const Box& box,
                              Revision revision) const {
  AskPage(pipeline, lineage, box, revision, 0, kFirstPage);
}

void ObjectVersions::AskPage(Pipeline& pipeline, int64_t lineage, const Box& box, Revision revision,
                             ObjectId after, int64_t most) const {
  static const auto& sql = *new std::string(
      absl::StrReplaceAll(kObjectsInBox, {{"$bytes", kObjectBytes}, {"$columns", kObjectColumns}}));
  pipeline.Ask(sql, map_, lineage, box.min.x, box.min.y, box.max.x, box.max.y, revision, after,
               most, kBytesAtOnce);
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::ReadInBox(GetConnection connection,
                                                                 int64_t lineage, const Box& box,
                                                                 Revision revision, Rows rows) {
  constexpr int kContent = 4;  // the first column of the content
  std::vector<ObjectPtr> objects;
  for (int64_t most = kFirstPage;; most = kVersionsPerPage) {
    ObjectId last = 0;
    Cache::Reading reading(&cache_);
    while (rows.Next()) {
      last = rows.Int64(0);
      const ObjectVersion version{lineage, last, rows.Int64(1), rows.Int64(2), rows.Int64(3)};
      HYPERMAP_RETURN_IF_ERROR(rows.row_status());
      HYPERMAP_RETURN_IF_ERROR(rows.IsNull(kContent) ? reading.Add(version)
                                                     : reading.Add(version, [&] {
                                                         return ReadObjectRow(&rows, kContent);
                                                       }));
    }
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObjectPtr> read, Finish(connection, &reading));
    objects.insert(objects.end(), read.begin(), read.end());
    if (rows.size() < most) return objects;
    HYPERMAP_ASSIGN_OR_RETURN(Connection* const idle, connection());
    Pipeline pipeline(idle);
    AskPage(pipeline, lineage, box, revision, last, kVersionsPerPage);
    HYPERMAP_ASSIGN_OR_RETURN(rows, pipeline.NextRows());
    HYPERMAP_RETURN_IF_ERROR(pipeline.Finish());
  }
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::Read(
    Connection& connection, absl::Span<const ObjectVersion> versions) {
  Cache::Reading reading(&cache_);
  for (const ObjectVersion& version : versions) HYPERMAP_RETURN_IF_ERROR(reading.Add(version));
  return Finish([&] { return &connection; }, &reading);
}

absl::StatusOr<std::vector<ObjectPtr>> ObjectVersions::Finish(GetConnection connection,
                                                              Cache::Reading* reading) {
  static const auto& sql =
      *new std::string(absl::StrReplaceAll(kFetchObjects, {{"$columns", kObjectColumns}}));
  return reading->Finish(
      [&](absl::Span<const ObjectVersion> batch, Cache::Take take) -> absl::Status {
        std::vector<int64_t> lineages, ids, ends;
        for (const ObjectVersion& version : batch) {
          lineages.push_back(version.lineage);
          ids.push_back(version.id);
          ends.push_back(version.end_revision);
        }
        HYPERMAP_ASSIGN_OR_RETURN(Connection* const idle, connection());
        HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                                  idle->Query(sql, map_, absl::MakeConstSpan(lineages),
                                              absl::MakeConstSpan(ids), absl::MakeConstSpan(ends)));
        while (rows.Next()) {
          const size_t number = static_cast<size_t>(rows.Int64(0) - 1);
          HYPERMAP_RETURN_IF_ERROR(take(number, ReadObjectRow(&rows, 1)));
        }
        return rows.row_status();
      });
}

}  // namespace hypermap::storage::postgres
