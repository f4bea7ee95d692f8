#include "storage/postgres/each_row.h"

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::storage::postgres {
namespace {

// A tile or an observation may have some hundred kilobytes.
constexpr int kRowsPerFetch = 200;

}  // namespace

absl::Status ForEachRow(Connection& connection, const std::string& sql,
                        absl::FunctionRef<absl::Status(Rows*)> use) {
  HYPERMAP_RETURN_IF_ERROR(
      connection.Execute(absl::StrCat("DECLARE each_row NO SCROLL CURSOR FOR ", sql)));
  const std::string fetch = absl::StrCat("FETCH ", kRowsPerFetch, " FROM each_row");
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(fetch));
    while (rows.Next()) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      HYPERMAP_RETURN_IF_ERROR(use(&rows));
    }
    if (rows.size() < kRowsPerFetch) break;
  }
  return connection.Execute("CLOSE each_row");
}

}  // namespace hypermap::storage::postgres
