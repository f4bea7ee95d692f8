// hypermap_metadata: the one row by which a GeoPackage is a map.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_METADATA_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_METADATA_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

struct MapMetadata {
  MapHeader header;
  Revision revision = 0;
  ObjectId next_object_id = 1;
  // The oldest revision that can be read.
  Revision oldest_revision = 0;
};

MapPosition PositionOf(const MapMetadata& metadata);

absl::Status InsertMetadata(Database* database, int64_t schema_version,
                            const MapMetadata& metadata);

// DATA_LOSS when the row is missing or wrong.
absl::StatusOr<MapMetadata> ReadMetadata(Database* database);

// Advances the map from one revision to another, which makes it complete. FAILED_PRECONDITION when
// the file is not at `from`, which only another program can have caused.
absl::Status AdvanceRevision(Database* database, Revision from, Revision to,
                             ObjectId next_object_id);

// Gives the map another incarnation.
absl::Status SetIncarnation(Database* database, uint64_t incarnation);

// Makes the map one that the request has created.
absl::Status SetCreation(Database* database, const std::string& request_id);

// Makes a provisional map, or an unfinished copy, complete.
absl::Status SetComplete(Database* database);

// Advances the oldest revision that can be read.
absl::Status SetOldestRevision(Database* database, Revision oldest);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_METADATA_H_
