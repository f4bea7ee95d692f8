// Deletions of maps: their record, and the removal of the rows.
#ifndef HYPERMAP_STORAGE_POSTGRES_DELETED_MAPS_H_
#define HYPERMAP_STORAGE_POSTGRES_DELETED_MAPS_H_

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// The name of the map that the request deleted; nullopt when it deleted none.
absl::StatusOr<std::optional<std::string>> FindDeletion(Connection* connection,
                                                        const std::string& request_id);

// Records that a request has deleted a map; nothing if its id is empty.
absl::Status RecordDeletion(Connection* connection, const std::string& request_id,
                            const std::string& map);

// Removes at most `max_rows` rows of maps that are deleted, in one transaction for each table.
// Returns true when more of them are left.
absl::StatusOr<bool> RemoveDeletedRows(Connection* connection, int max_rows);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_DELETED_MAPS_H_
