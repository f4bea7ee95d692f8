// The schema "hypermap" of a PostgreSQL database, which holds the maps of a site or of many.
#ifndef HYPERMAP_STORAGE_POSTGRES_SCHEMA_H_
#define HYPERMAP_STORAGE_POSTGRES_SCHEMA_H_

#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

inline constexpr int64_t kSchemaVersion = 2;

// The end_revision of what exists at the newest revision.
inline constexpr int64_t kForever = std::numeric_limits<int64_t>::max();

// Creates the schema, or brings that of an older version to this one, in one transaction that waits
// for other servers that do the same. If PostGIS is installed in the database, or can be, objects
// get a column that it can query. Returns whether they have it. FAILED_PRECONDITION if the schema
// is newer, or if the extension btree_gist is missing.
absl::StatusOr<bool> PrepareSchema(Connection* connection);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_SCHEMA_H_
