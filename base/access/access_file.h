// The file of the identities: read by servers, changed by `hypermap token`.
#ifndef HYPERMAP_BASE_ACCESS_ACCESS_FILE_H_
#define HYPERMAP_BASE_ACCESS_ACCESS_FILE_H_

#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/access/access_table.h"

namespace hypermap::access {

// Reads the file. INVALID_ARGUMENT naming the file and what is wrong, also if other users may write
// it; NOT_FOUND and PERMISSION_DENIED.
absl::StatusOr<AccessTable> ReadAccessFile(const std::string& path);

// Changes the file, or makes it (mode 0640) if it is missing: reads it, lets `change` change the
// table, and replaces the file as a whole, so that a server never reads half of it. Of several
// processes that do so, one after the other changes it. The file is as it was after any error.
absl::Status ChangeAccessFile(const std::string& path,
                              absl::FunctionRef<absl::Status(AccessTable&)> change);

}  // namespace hypermap::access

#endif  // HYPERMAP_BASE_ACCESS_ACCESS_FILE_H_
