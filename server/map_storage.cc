#include "server/map_storage.h"

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

absl::StatusOr<std::unique_ptr<storage::MapStore>> OpenDatabase(const StorageOptions& options) {
#ifdef HYPERMAP_POSTGRES
  HYPERMAP_RETURN_IF_ERROR(storage::MakeFolder(options.data_dir));
  storage::PostgresOptions postgres;
  postgres.target = options.database;
  postgres.server_id = options.server_id;
  postgres.open_files = [](const std::string& folder) {
    return storage::OpenGeoPackageStore(folder);
  };
  return storage::OpenPostgresStore(postgres);
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

absl::StatusOr<std::unique_ptr<storage::MapStore>> OpenStore(const StorageOptions& options) {
  if (!options.database.empty()) return OpenDatabase(options);
  return storage::OpenGeoPackageStore(
      options.data_dir, {.reserve_bytes = kReserveBytes,
                         .trash_age = options.trash_age,
                         .cache_room = std::make_shared<storage::CacheRoom>(options.cache_bytes)});
}

}  // namespace hypermap::server
