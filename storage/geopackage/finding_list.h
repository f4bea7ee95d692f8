// Collects what the parts of a check find.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FINDING_LIST_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FINDING_LIST_H_

#include <cstddef>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "map/check_report.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

class FindingList {
 public:
  // The most findings that a report describes. It only counts further ones.
  static constexpr size_t kMaxFindings = 10'000;

  void Add(const Finding& finding);

  // Adds a finding if the error tells damage, so that the check goes on with the next row or table.
  // Returns other errors, with which no check is possible: those of CheckCancelled and of the disk.
  absl::Status AddDamage(const std::string& table, const std::string& row,
                         const absl::Status& status, bool can_be_rebuilt = false);

  // Adds a finding like `about` for each row of a query, whose only column is the text that names
  // the row. An error of the query is damage of the table.
  template <typename... Values>
  absl::Status AddRows(Database* database, const Finding& about, const std::string& sql,
                       const Values&... values) {
    absl::StatusOr<Statement> select = database->Prepare(sql);
    absl::Status status = select.status();
    if (status.ok()) status = AddEach(&select->Bind(values...), about);
    return AddDamage(about.table, "", status, about.can_be_rebuilt);
  }

  void set_revision(Revision revision) { report_.revision = revision; }
  CheckReport Take() && { return std::move(report_); }

 private:
  absl::Status AddEach(Statement* select, const Finding& about);

  CheckReport report_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FINDING_LIST_H_
