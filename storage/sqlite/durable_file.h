// Operations on files and folders that are durable when they return, unless they say otherwise, so
// that after a crash a file is there completely or not at all. UNAVAILABLE if the disk fails;
// RESOURCE_EXHAUSTED if it is full, or if the process may open no more files.
#ifndef HYPERMAP_STORAGE_SQLITE_DURABLE_FILE_H_
#define HYPERMAP_STORAGE_SQLITE_DURABLE_FILE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// The folder that contains `path`.
std::string FolderOf(const std::string& path);

// Creates a folder and its parents; OK when it exists.
absl::Status MakeFolder(const std::string& path);

// Returns whether anything has that name, even a broken link.
absl::StatusOr<bool> FindPath(const std::string& path);
// The same, and true if that can't be told now.
bool PathExists(const std::string& path);

// The status of an error number of the calls below.
absl::Status FileError(int error, absl::string_view what);

// Makes the creation, renaming and removal of files in a folder durable.
absl::Status SyncFolder(const std::string& path);

// Renames a closed file to its final name; content and name are on disk when this returns. On error
// nothing has the final name, but after a power loss the file may have it. REQUIRES: nothing has
// the final name, and no connection has the file open, because closing it here would drop that
// connection's POSIX locks.
absl::Status PublishFile(const std::string& temporary, const std::string& path);

// As PublishFile, in place of the file that has the final name, if there is one: at every moment,
// also after a power loss, the name is that of one of the two. On error the name is that of the
// earlier file, unless the file system can't exchange names and the error says so; what is called
// `temporary` then is to be removed.
absl::Status ReplaceFile(const std::string& temporary, const std::string& path);

// Gives a closed file a second name, or copies it where the file system has no second names. On
// error nothing has the name. REQUIRES: nothing has the name; as PublishFile.
absl::Status LinkOrCopyFile(const std::string& from, const std::string& to);

// Renames a file or folder within a file system, in place of a file of that name; OK when there is
// none. Not durable before SyncFolder of both folders.
absl::Status MoveFile(const std::string& from, const std::string& to);

// OK when the file does not exist.
absl::Status RemoveFile(const std::string& path);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_DURABLE_FILE_H_
