#include "storage/geopackage/time_mark_table.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {

const char kCreateTimeMarks[] = R"sql(
CREATE TABLE hypermap_time_marks (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL,
  commit_time_ns INTEGER NOT NULL,
  passed_ns INTEGER NOT NULL,
  lived_ns INTEGER NOT NULL,
  server_time_ns INTEGER NOT NULL,
  boot_id TEXT NOT NULL,
  since_boot_ns INTEGER NOT NULL
);
)sql";

absl::StatusOr<std::vector<TimeMark>> ReadTimeMarks(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare("SELECT revision, commit_time_ns, passed_ns, lived_ns, server_time_ns, "
                        "boot_id, since_boot_ns FROM hypermap_time_marks ORDER BY id"));
  std::vector<TimeMark> marks;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return marks;
    TimeMark mark;
    mark.revision = select.Int64(0);
    mark.commit_time = absl::FromUnixNanos(select.Int64(1));
    mark.passed = absl::Nanoseconds(select.Int64(2));
    mark.lived = absl::Nanoseconds(select.Int64(3));
    mark.server_time = absl::FromUnixNanos(select.Int64(4));
    mark.boot_id = std::string(select.Text(5));
    mark.since_boot = absl::Nanoseconds(select.Int64(6));
    if (!select.row_status().ok()) {
      return absl::DataLossError(
          absl::StrCat("hypermap_time_marks: ", select.row_status().message()));
    }
    const bool goes_back =
        !marks.empty() &&
        (mark.revision < marks.back().revision || mark.commit_time < marks.back().commit_time ||
         mark.passed < marks.back().passed || mark.lived < marks.back().lived);
    if (goes_back) {
      return absl::DataLossError(absl::StrCat("hypermap_time_marks: time goes back after revision ",
                                              marks.back().revision));
    }
    marks.push_back(std::move(mark));
  }
}

absl::Status InsertTimeMark(Database* database, const TimeMark& mark,
                            absl::Duration forget_before) {
  HYPERMAP_RETURN_IF_ERROR(database->Run(
      "INSERT INTO hypermap_time_marks (revision, commit_time_ns, passed_ns, lived_ns, "
      "server_time_ns, boot_id, since_boot_ns) VALUES (?, ?, ?, ?, ?, ?, ?)",
      mark.revision, absl::ToUnixNanos(mark.commit_time), absl::ToInt64Nanoseconds(mark.passed),
      absl::ToInt64Nanoseconds(mark.lived), absl::ToUnixNanos(mark.server_time), mark.boot_id,
      absl::ToInt64Nanoseconds(mark.since_boot)));
  return database->Run(
      "DELETE FROM hypermap_time_marks WHERE id < (SELECT max(id) FROM hypermap_time_marks "
      "WHERE passed_ns < ?)",
      absl::ToInt64Nanoseconds(forget_before));
}

}  // namespace hypermap::storage
