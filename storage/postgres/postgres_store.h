// A MapStore in a PostgreSQL database, which several servers may share.
//
// Each map is owned by one server at a time, which alone writes it. A server that ends gives its
// maps back; those of a server that dies can be opened by another when its lease is over. All
// tables are in the schema "hypermap" (tables.h); docs/postgres_format.md describes them.
#ifndef HYPERMAP_STORAGE_POSTGRES_POSTGRES_STORE_H_
#define HYPERMAP_STORAGE_POSTGRES_POSTGRES_STORE_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/cache_room.h"
#include "storage/map_store.h"

namespace hypermap::storage {

// Opens a store of maps in files, in a folder that is empty or has been its own.
using OpenFolder =
    std::function<absl::StatusOr<std::unique_ptr<MapStore>>(const std::string& folder)>;

struct PostgresOptions {
  // A connection string or URI of libpq, of a direct connection to the primary.
  std::string target;
  // The same for readers of past revisions, which may go through a pooler such as pgbouncer in
  // transaction mode; empty: `target`.
  std::string readers_target;
  // Distinguishes this server from the others that use the database. The same id again gets the
  // maps that it had without waiting for the end of a lease. Empty: a random one.
  std::string server_id;
  // After a server has died its maps can be opened by others once this is over.
  absl::Duration lease = absl::Seconds(3);
  // Memory for what the readers of past revisions keep of what they have read. Never null.
  CacheRoomPtr cache_room = std::make_shared<CacheRoom>(int64_t{256} << 20);
  // The store whose files backups are. Null: maps can't be backed up, nor restored.
  OpenFolder open_files;
};

// Opens the store, and makes its schema if there is none. UNAVAILABLE if the database can't be
// reached; FAILED_PRECONDITION if it can't be used. The store must outlive its maps.
absl::StatusOr<std::unique_ptr<MapStore>> OpenPostgresStore(const PostgresOptions& options);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_POSTGRES_POSTGRES_STORE_H_
