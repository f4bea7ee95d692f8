#include "server/map_storage.h"

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/sqlite/durable_file.h"
#ifdef HYPERMAP_POSTGRES
#include "storage/postgres/postgres_store.h"
#endif

namespace hypermap::server {
namespace {

// Space in the data folder with which maps can be deleted when the disk is full.
constexpr int64_t kReserveBytes = int64_t{8} << 20;

absl::StatusOr<OpenedStorage> OpenDatabase(const StorageOptions& options) {
#ifdef HYPERMAP_POSTGRES
  HYPERMAP_RETURN_IF_ERROR(storage::MakeFolder(options.data_dir));
  absl::StatusOr<storage::FileLock> lock =
      storage::FileLock::Acquire(absl::StrCat(options.data_dir, "/LOCK"));
  if (!lock.ok()) {
    return absl::Status(lock.status().code(),
                        absl::StrCat("cannot use the data folder ", options.data_dir, ": ",
                                     lock.status().message()));
  }
  storage::PostgresOptions postgres;
  postgres.target = options.database;
  postgres.readers_target = options.database_of_readers;
  postgres.server_id = options.server_id;
  postgres.cache_room = std::make_shared<storage::CacheRoom>(options.cache_bytes);
  postgres.open_files = [](const std::string& folder) {
    return storage::OpenGeoPackageStore(folder);
  };
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::MapStore> store,
                            storage::OpenPostgresStore(postgres));
  return OpenedStorage{*std::move(lock), std::move(store)};
#else
  return CheckStore(options.database);
#endif
}

}  // namespace

absl::Status CheckStore(const std::string& database) {
  if (database.empty()) return absl::OkStatus();
  if (!absl::StartsWith(database, "postgresql://") && !absl::StartsWith(database, "postgres://")) {
    return absl::InvalidArgumentError("--store must begin with postgresql://");
  }
#ifndef HYPERMAP_POSTGRES
  return absl::InvalidArgumentError("--store: this program was built without PostgreSQL");
#else
  return absl::OkStatus();
#endif
}

absl::StatusOr<OpenedStorage> OpenStorage(const StorageOptions& options) {
  if (!options.database.empty()) return OpenDatabase(options);
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<storage::MapStore> store,
      storage::OpenGeoPackageStore(
          options.data_dir,
          {.reserve_bytes = kReserveBytes,
           .trash_age = options.trash_age,
           .cache_room = std::make_shared<storage::CacheRoom>(options.cache_bytes)}));
  return OpenedStorage{std::nullopt, std::move(store)};
}

}  // namespace hypermap::server
