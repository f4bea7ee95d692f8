// Hypermap's own tables in a GeoPackage, and how an older file becomes a new one.
//
// docs/geopackage_format.md tells the tables and columns. Every version of the schema keeps
// hypermap_metadata.schema_version, so that any program can tell whether it understands a file.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The version that this program writes.
inline constexpr int64_t kSchemaVersion = 3;

// One step forward, from `from_version` to the next.
struct Migration {
  int64_t from_version;
  absl::Status (*apply)(Database* database);
};

// The steps of all released versions.
absl::Span<const Migration> ReleasedMigrations();

// Makes an empty database an empty map at revision 0, in one transaction.
absl::Status CreateSchema(Database* database, const MapHeader& header);

// FAILED_PRECONDITION when the database is no GeoPackage or no map; DATA_LOSS when it is too
// damaged to tell. Reads only.
absl::StatusOr<int64_t> ReadSchemaVersion(Database* database);

// Brings a map to the version `newest` by `migrations`, in one transaction. FAILED_PRECONDITION for
// a map that is newer, or older than the first step.
absl::Status MigrateSchema(Database* database, int64_t newest,
                           absl::Span<const Migration> migrations);

// DATA_LOSS naming the table of ours or of the standard that is missing or lacks a column.
absl::Status VerifySchema(Database* database);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_H_
