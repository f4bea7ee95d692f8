// The number of files and sockets that the process may have open.
#ifndef HYPERMAP_BASE_ADMISSION_FILE_LIMIT_H_
#define HYPERMAP_BASE_ADMISSION_FILE_LIMIT_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "base/admission/open_connections.h"

namespace hypermap::admission {

// Raises the soft limit of open files (ulimit -n) to the hard one, as far as the system allows, and
// returns the limit that holds then.
int64_t RaiseFileLimit();

// Returns the limits of a server's connections, so that `reserved` files for other uses stay
// available below `file_limit`. `asked` has the values of --max_connections and
// --max_connections_per_address; 0 stands for what fits (three quarters of the files that are not
// reserved, at most 10,000), and for three quarters of all connections. FAILED_PRECONDITION, naming
// ulimit, if fewer than 16 fit; INVALID_ARGUMENT if more are asked for than fit.
absl::StatusOr<ConnectionLimits> LimitConnections(const ConnectionLimits& asked, int64_t file_limit,
                                                  int64_t reserved);

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_FILE_LIMIT_H_
