#include "storage/postgres/time_marks.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kReadMarks[] = R"sql(
SELECT number, revision, commit_time_ns, passed_ns, lived_ns, server_time_ns, boot_id,
    since_boot_ns
  FROM hypermap.time_marks WHERE map = $1 ORDER BY number
)sql";
constexpr char kInsertMark[] = R"sql(
INSERT INTO hypermap.time_marks (map, number, revision, commit_time_ns, passed_ns, lived_ns,
    server_time_ns, boot_id, since_boot_ns)
  SELECT $1, coalesce(max(number), 0) + 1, $2, $3, $4, $5, $6, $7, $8
    FROM hypermap.time_marks WHERE map = $1
)sql";
constexpr char kForgetMarks[] = R"sql(
DELETE FROM hypermap.time_marks WHERE map = $1 AND number <
  (SELECT max(number) FROM hypermap.time_marks WHERE map = $1 AND passed_ns < $2)
)sql";

absl::Status DamagedMark(int64_t number, absl::string_view what) {
  return absl::DataLossError(absl::StrCat("hypermap.time_marks, number ", number, ": ", what));
}

TimeMark MarkAt(Rows* rows) {
  TimeMark mark;
  mark.revision = rows->Int64(1);
  mark.commit_time = absl::FromUnixNanos(rows->Int64(2));
  mark.passed = absl::Nanoseconds(rows->Int64(3));
  mark.lived = absl::Nanoseconds(rows->Int64(4));
  mark.server_time = absl::FromUnixNanos(rows->Int64(5));
  mark.boot_id = std::string(rows->Text(6));
  mark.since_boot = absl::Nanoseconds(rows->Int64(7));
  return mark;
}

}  // namespace

absl::StatusOr<std::vector<TimeMark>> ReadTimeMarks(Connection& connection, int64_t map) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(kReadMarks, map));
  std::vector<TimeMark> marks;
  while (rows.Next()) {
    TimeMark mark = MarkAt(&rows);
    const int64_t number = rows.Int64(0);
    if (!rows.row_status().ok()) return DamagedMark(number, rows.row_status().message());
    const bool goes_back =
        !marks.empty() &&
        (mark.revision < marks.back().revision || mark.commit_time < marks.back().commit_time ||
         mark.passed < marks.back().passed || mark.lived < marks.back().lived);
    if (goes_back) return DamagedMark(number, "time goes back");
    marks.push_back(std::move(mark));
  }
  return marks;
}

absl::Status AddTimeMark(OwnedMap& owned, const TimeMark& mark, absl::Duration forget_before) {
  return owned.Write([&](Pipeline& pipeline) {
    pipeline.Add(kInsertMark, owned.map(), mark.revision, absl::ToUnixNanos(mark.commit_time),
                 absl::ToInt64Nanoseconds(mark.passed), absl::ToInt64Nanoseconds(mark.lived),
                 absl::ToUnixNanos(mark.server_time), mark.boot_id,
                 absl::ToInt64Nanoseconds(mark.since_boot));
    pipeline.Add(kForgetMarks, owned.map(), absl::ToInt64Nanoseconds(forget_before));
    return absl::OkStatus();
  });
}

}  // namespace hypermap::storage::postgres
