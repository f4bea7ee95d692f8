// Rows of a map's file that break a rule.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FIND_ROWS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FIND_ROWS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/check_report.h"
#include "storage/finding_list.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Adds a finding like `about` for each row that the statement gives.
absl::Status AddEachRow(Statement* select, const Finding& about, FindingList* findings);

// Adds a finding like `about` for each row of a query, whose only column is the text that names the
// row. An error of the query is damage of the table.
template <typename... Values>
absl::Status FindRows(Database* database, const Finding& about, FindingList* findings,
                      const std::string& sql, const Values&... values) {
  absl::StatusOr<Statement> select = database->Prepare(sql);
  absl::Status status = select.status();
  if (status.ok()) status = AddEachRow(&select->Bind(values...), about, findings);
  return findings->AddDamage(about.table, "", status, about.can_be_rebuilt);
}

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FIND_ROWS_H_
