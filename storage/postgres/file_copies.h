// Copies of maps as files: backups, and what is restored from them. The files are those of another
// store, which the program gives (PostgresOptions::open_files).
#ifndef HYPERMAP_STORAGE_POSTGRES_FILE_COPIES_H_
#define HYPERMAP_STORAGE_POSTGRES_FILE_COPIES_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/connection.h"
#include "storage/map_store.h"
#include "storage/postgres/postgres_store.h"

namespace hypermap::storage::postgres {

// A backup of the map that `pin` opens when the backup is written. Beside the file a folder is
// made, PATH.store, and removed.
std::unique_ptr<MapBackup> MakeFileBackup(
    OpenFolder open_files, std::string map,
    std::function<absl::StatusOr<std::unique_ptr<ReadableMap>>()> pin);

// The most bytes that such a backup takes, with its folder, by the sizes of the map's rows, of
// which each is looked at.
absl::StatusOr<int64_t> BytesOfFileBackup(Connection& connection, int64_t map);

// As MapStore::CheckFile.
absl::StatusOr<CheckReport> CheckFileOf(const OpenFolder& open_files, const std::string& path,
                                        const EvidenceCheck& evidence);

// Calls `use` with the map in a file as one that the request has created, of another incarnation.
// The file stays as it is.
absl::Status UseMapInFile(const OpenFolder& open_files, const std::string& path,
                          const std::string& name, const std::string& request_id,
                          absl::FunctionRef<absl::Status(StoredMap&)> use);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_FILE_COPIES_H_
