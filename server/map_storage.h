// Opens the store of the server's maps.
#ifndef HYPERMAP_SERVER_MAP_STORAGE_H_
#define HYPERMAP_SERVER_MAP_STORAGE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/map_store.h"
#include "storage/sqlite/file_lock.h"

namespace hypermap::server {

struct StorageOptions {
  // The folder of GeoPackages, and of the server's temporary files in any case.
  std::string data_dir;
  // A URI of libpq, "postgresql://…"; empty: the maps are GeoPackages.
  std::string database;
  // The same for connections that only read, perhaps through a pooler; empty: `database`.
  std::string database_of_readers;
  // In a database: the name of this server among those that share it; empty: a random one.
  std::string server_id;
  // How long deleted GeoPackages are kept.
  absl::Duration trash_age;
  // Memory for what readers of past revisions keep of what they have read.
  int64_t cache_bytes = 0;
};

// INVALID_ARGUMENT if the store can't be one of this program's.
absl::Status CheckStore(const std::string& database);

struct OpenedStorage {
  // Keeps other servers out of the folder, whose temporary files they would remove; nullopt if the
  // store does that itself.
  std::optional<storage::FileLock> lock;
  std::unique_ptr<storage::MapStore> store;
};

// FAILED_PRECONDITION if another server uses the folder; errors of OpenGeoPackageStore and
// OpenPostgresStore.
absl::StatusOr<OpenedStorage> OpenStorage(const StorageOptions& options);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_MAP_STORAGE_H_
