// Hypermap's own tables in a GeoPackage: creating, checking and migrating them.
//
// docs/geopackage_format.md describes the tables and columns. Every version of the schema has the
// column hypermap_metadata.schema_version, so that any program can tell whether it understands a
// file.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "storage/geopackage/schema_migrations.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The version that this program writes.
inline constexpr int64_t kSchemaVersion = 8;

// Makes an empty database an empty map at revision 0, in one transaction.
absl::Status CreateSchema(Database* database, const MapHeader& header);

// Reads the schema version of a map. FAILED_PRECONDITION when the database is not a GeoPackage or
// not a map; DATA_LOSS when it is too damaged to tell.
absl::StatusOr<int64_t> ReadSchemaVersion(Database* database);

// FAILED_PRECONDITION if a version is newer than `newest`.
absl::Status CheckIsNotNewer(int64_t version, int64_t newest);

// FAILED_PRECONDITION if a version is not kSchemaVersion, which readers of files need.
absl::Status CheckIsOfThisVersion(int64_t version);

// Brings a map to the version `newest` by `migrations`, all in one transaction: when a step fails,
// the file stays as it was. FAILED_PRECONDITION for a map that is newer, or older than the first
// step.
absl::Status MigrateSchema(Database* database, int64_t newest,
                           absl::Span<const Migration> migrations);

// DATA_LOSS naming the first table, of ours or of the standard, that is missing or lacks a column.
absl::Status VerifySchema(Database* database);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_H_
