// Creating, opening and removing the file of a map. Opening checks that the file is a map and
// intact.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_MAP_FILE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_MAP_FILE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/geopackage/geopackage_options.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Creates the file of an empty map. It is built as `temporary` and then renamed, so that after a
// crash it is there completely or not at all. On error it is not there.
absl::Status CreateMapFile(const std::string& path, const std::string& temporary,
                           const MapHeader& header, const GeoPackageOptions& options);

struct OpenMap {
  std::unique_ptr<Database> database;
  std::string older_copy;  // of the file as it was before it was migrated; empty if it was not
  bool was_written_by_others = false;  // since a store has closed it
  absl::Status damage;                 // DATA_LOSS naming the pages that can't be read, if any
};
// Opens a map's file for writing, checks it, and sets write-ahead logging. A file of an older
// schema version, or without checksums, is written anew, migrated, and put in its place; one of an
// older version is kept as OlderCopyOf. What other programs wrote is adopted (foreign_writes.h).
// A file of which only some pages fail their checksums is opened, and what is read from them is
// DATA_LOSS. FAILED_PRECONDITION when the file is not a map, has a newer version or is read-only;
// DATA_LOSS when it is damaged in another way; RESOURCE_EXHAUSTED when the disk has no room for a
// new file.
absl::StatusOr<OpenMap> OpenMapFile(const std::string& path, const GeoPackageOptions& options);

// The name of the copy of a map's file of an older schema version.
std::string OlderCopyOf(const std::string& path, int64_t version);

// Migrates a map's file to the newest schema version, if it is older, and leaves neither a log nor
// a copy beside it. A file that does not tell its version stays as it is. FAILED_PRECONDITION when
// the file is not a map or has a newer version. REQUIRES: no connection has the file open.
absl::Status MigrateMapFile(const std::string& path, const GeoPackageOptions& options);

// Makes a map's file one that the request has created and that is complete, and leaves no log
// beside it. REQUIRES: no connection has the file open; the schema version is the newest.
absl::Status MarkRestored(const std::string& path, const std::string& request_id,
                          const GeoPackageOptions& options);

// Returns whether the file tells that the request has created or restored the map; false if it
// can't be read, or `request_id` is empty.
bool WasMadeBy(const std::string& path, const std::string& request_id);

// Returns whether the file tells that it is an unfinished copy; false if it can't be read. Changes
// nothing. REQUIRES: nobody writes to the file.
bool IsUnfinishedCopy(const std::string& path);

// The write-ahead log that SQLite keeps beside a map's file.
std::string LogPathOf(const std::string& path);

// The name that a log gets when it does not belong to the map's file.
std::string OrphanPathOf(const std::string& path);

// Renames the log of a map's file to OrphanPathOf(path), in place of an older one, so that SQLite
// does not apply it to the file.
absl::Status SetLogAside(const std::string& path);

// The incarnation in a map's file without its log; 0 if the file is of a version that had none;
// nullopt if the file does not tell. UNAVAILABLE or RESOURCE_EXHAUSTED if it can't be read now.
// REQUIRES: no connection has the file open.
absl::StatusOr<std::optional<uint64_t>> ReadIncarnationWithoutLog(const std::string& path);

// DATA_LOSS with the first damage that a check of every page, index and constraint finds.
absl::Status CheckIntegrity(Database* database);

// Returns whether a check of SQLite found a page that could not be read, which may pass, rather
// than one that is damaged. It reports both alike.
bool IsReadError(absl::string_view problem);

// Moves the log into the file, and waits for it. Returns whether the file is the whole map, which
// it is not while another program reads an older state.
absl::StatusOr<bool> MoveLogIntoFile(Database* database);

// How to read a map's file without changing it or making files beside it: with its log if it has
// one. REQUIRES: nobody writes to it.
Database::OpenMode ModeForReading(const std::string& path);

// Removes the files that SQLite keeps beside a map's file. REQUIRES: the map's file does not exist.
absl::Status RemoveSidecars(const std::string& path);

// Removes a map's file and the files beside it, also a log that was set aside, durably. When the
// map's file can't be removed, nothing is.
absl::Status RemoveMapFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_MAP_FILE_H_
