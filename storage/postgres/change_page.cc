#include "storage/postgres/change_page.h"

#include <utility>

#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "storage/postgres/object_versions.h"

namespace hypermap::storage::postgres {
namespace {

constexpr int64_t kChangesPerPage = 1024;
constexpr int64_t kEnoughBytes = 4 << 20;

// Each change of an object or tile has at most two versions: the one that it ends, and the one
// after that. The lateral queries are run for each change, so that their cost depends neither on
// the size of the tables nor on the number of an object's versions. $bytes stands for kObjectBytes.
constexpr char kChangePage[] = R"sql(
SELECT c.revision, c.number, c.kind, c.lineage, c.object_id, c.tile_row, c.tile_col, c.detail,
    coalesce(o.first_revision, t.first_revision), coalesce(o.end_revision, t.end_revision),
    coalesce(o.bytes, t.bytes)
  FROM (
    SELECT *, sum(octet_length(detail)) OVER (
        ORDER BY revision, number ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING) AS bytes_before
      FROM hypermap.changes
      WHERE map = $1 AND (revision, number) > ($2, $3) AND revision <= $4
      ORDER BY revision, number LIMIT $5) AS c
  LEFT JOIN LATERAL (
    SELECT first_revision, end_revision, $bytes AS bytes FROM hypermap.objects
      WHERE map = $1 AND lineage = c.lineage AND object_id = c.object_id
        AND end_revision >= c.revision ORDER BY end_revision LIMIT 2) AS o ON true
  LEFT JOIN LATERAL (
    SELECT first_revision, end_revision, octet_length(image)::int8 AS bytes FROM hypermap.tiles
      WHERE map = $1 AND lineage = c.lineage AND tile_row = c.tile_row AND tile_col = c.tile_col
        AND end_revision >= c.revision ORDER BY end_revision LIMIT 2) AS t ON true
  WHERE coalesce(c.bytes_before, 0) < $6
  ORDER BY c.revision, c.number
)sql";
constexpr int kVersionColumn = 8;

LoggedChange ReadChange(Rows* row) {
  LoggedChange change;
  change.place = {row->Int64(0), row->Int64(1)};
  change.kind = std::string(row->Text(2));
  change.lineage = row->OptionalInt64(3).value_or(0);
  change.object_id = row->OptionalInt64(4).value_or(0);
  change.tile_row = row->OptionalInt64(5).value_or(0);
  change.tile_col = row->OptionalInt64(6).value_or(0);
  if (!row->IsNull(7)) change.detail = std::string(row->Text(7));
  return change;
}

void AddVersion(Rows* row, LoggedChange* change) {
  if (row->IsNull(kVersionColumn)) return;
  const LoggedVersion version{row->Int64(kVersionColumn), row->Int64(kVersionColumn + 1),
                              row->Int64(kVersionColumn + 2)};
  if (version.end_revision == change->place.revision) {
    change->before = version;
  } else if (version.first_revision <= change->place.revision) {
    change->after = version;
  }
}

}  // namespace

absl::StatusOr<ChangePage> ReadChangePage(Connection& connection, int64_t map,
                                          const ChangePlace& after, Revision last) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows,
      connection.Query(absl::StrReplaceAll(kChangePage, {{"$bytes", kObjectBytes}}), map,
                       after.revision, after.number, last, kChangesPerPage, kEnoughBytes));
  ChangePage page;
  int64_t bytes = 0;
  while (rows.Next()) {
    LoggedChange change = ReadChange(&rows);
    if (page.changes.empty() || page.changes.back().place != change.place) {
      bytes += static_cast<int64_t>(change.detail.size());
      page.changes.push_back(std::move(change));
    }
    AddVersion(&rows, &page.changes.back());
  }
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  page.may_have_next =
      bytes >= kEnoughBytes || page.changes.size() == static_cast<size_t>(kChangesPerPage);
  return page;
}

}  // namespace hypermap::storage::postgres
