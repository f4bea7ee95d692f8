// Reads all rows of a query, however many there are.
#ifndef HYPERMAP_STORAGE_POSTGRES_EACH_ROW_H_
#define HYPERMAP_STORAGE_POSTGRES_EACH_ROW_H_

#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Calls `use` for each row of a query without parameters, of which some are in memory at a time.
// Ends with its first error; errors of Connection and of CheckCancelled. `use` must not read other
// rows in this way. REQUIRES: a transaction of the caller.
absl::Status ForEachRow(Connection& connection, const std::string& sql,
                        absl::FunctionRef<absl::Status(Rows*)> use);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_EACH_ROW_H_
