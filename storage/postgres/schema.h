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

// The WKB in the column `shape` of hypermap.objects, as an expression. The blob begins with 8
// bytes, and an envelope whose size bits 1 to 3 of the fourth byte tell (OGC 12-128r18, 2.1.3.1.1).
inline constexpr char kWkbOfShape[] =
    "substring(shape FROM 9 + CASE (get_byte(shape, 3) >> 1) & 7 "
    "WHEN 0 THEN 0 WHEN 1 THEN 32 WHEN 4 THEN 64 ELSE 48 END)";

// Whether objects have a column of PostGIS, `geom`.
absl::StatusOr<bool> HasGeometry(Connection* connection);

// Creates the schema, or brings that of an older version to this one, in one transaction that waits
// for other servers that do the same. If PostGIS is installed in the database, or can be, objects
// get a column that it can query. Returns whether they have it. FAILED_PRECONDITION if the schema
// is newer, or if the extension btree_gist is missing.
absl::StatusOr<bool> PrepareSchema(Connection* connection);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_SCHEMA_H_
