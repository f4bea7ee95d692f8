// The steps that bring a map file of an older schema version to the newest.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_MIGRATIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_MIGRATIONS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// One step, from `from_version` to the version after it. `apply` runs within the transaction of
// MigrateSchema, which also raises hypermap_metadata.schema_version.
struct Migration {
  int64_t from_version;
  absl::Status (*apply)(Database* database);
};

// The steps from all released versions, in order.
absl::Span<const Migration> ReleasedMigrations();

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_SCHEMA_MIGRATIONS_H_
