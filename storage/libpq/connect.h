// Opens sessions. Only for the sources of this room.
#ifndef HYPERMAP_STORAGE_LIBPQ_CONNECT_H_
#define HYPERMAP_STORAGE_LIBPQ_CONNECT_H_

#include <libpq-fe.h>

#include <memory>

#include "absl/status/statusor.h"
#include "storage/libpq/connect_options.h"

namespace hypermap::storage::postgres {

struct CloseConnection {
  void operator()(PGconn* handle) const { PQfinish(handle); }
};
using Handle = std::unique_ptr<PGconn, CloseConnection>;

// Connects, in non-blocking mode. UNAVAILABLE; FAILED_PRECONDITION if the target is no connection
// string, or the role or the database do not exist; errors of CheckCancelled.
absl::StatusOr<Handle> Connect(const ConnectOptions& options);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_CONNECT_H_
