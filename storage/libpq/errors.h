// Errors of PostgreSQL as absl::Status.
//
// SQLSTATEs are mapped as follows: connection errors, shutdowns, serialization failures, deadlocks,
// timeouts, failed file calls, a full table of connections and a standby that accepts no writes ->
// UNAVAILABLE; a full disk, exhausted memory and what exceeds the database's limits ->
// RESOURCE_EXHAUSTED; damaged data and indexes -> DATA_LOSS; text that the database can't store ->
// INVALID_ARGUMENT; a violated unique constraint -> ALREADY_EXISTS; missing databases, roles and
// rights -> FAILED_PRECONDITION; the rest, which are faults of the program, -> INTERNAL.
#ifndef HYPERMAP_STORAGE_LIBPQ_ERRORS_H_
#define HYPERMAP_STORAGE_LIBPQ_ERRORS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage::postgres {

// The SQLSTATE of an error that the database reported; empty for other errors.
std::string SqlStateOf(const absl::Status& status);

// The error for a SQLSTATE, of which SqlStateOf returns it again.
absl::Status DatabaseError(absl::string_view sqlstate, absl::string_view message);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_ERRORS_H_
