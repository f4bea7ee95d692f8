// Files that must be wholly there or not at all after a crash.
#ifndef HYPERMAP_STORAGE_SQLITE_DURABLE_FILE_H_
#define HYPERMAP_STORAGE_SQLITE_DURABLE_FILE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// The folder that holds `path`.
std::string FolderOf(const std::string& path);

// Makes a folder and those above it; OK when it is there.
absl::Status MakeFolder(const std::string& path);

// Whether anything has that name, also a broken link.
bool PathExists(const std::string& path);

// Makes the names in a folder durable.
absl::Status SyncFolder(const std::string& path);

// Gives a closed file its final name: content and name are on disk when this returns. The final
// name must be free, and no process may have the file open as a database: closing it here would
// drop that process's POSIX locks.
absl::Status PublishFile(const std::string& temporary, const std::string& path);

// OK when it was not there.
absl::Status RemoveFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_DURABLE_FILE_H_
