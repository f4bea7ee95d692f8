// Reads a revision of a map as a whole.
#ifndef HYPERMAP_STORAGE_POSTGRES_MAP_LOADING_H_
#define HYPERMAP_STORAGE_POSTGRES_MAP_LOADING_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Reads the newest revision, in pages, each with a statement of its own, so that no transaction is
// long. The map may be written meanwhile. A layer of which something can't be read is in
// Snapshot::damaged. DATA_LOSS naming the table if that concerns all of the map; UNAVAILABLE, also
// if the revision was forgotten before all of it was read.
absl::StatusOr<SnapshotPtr> LoadSnapshot(Connection* connection, int64_t map,
                                         const std::string& name);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_MAP_LOADING_H_
