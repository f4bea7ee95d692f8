// Locks between processes.
#ifndef HYPERMAP_STORAGE_SQLITE_FILE_LOCK_H_
#define HYPERMAP_STORAGE_SQLITE_FILE_LOCK_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::storage {

// An exclusive flock(2) on a file made for that purpose. It is released when the object is
// destroyed or the process ends, also when that is killed. Two locks on one path exclude each other
// within a process as well.
class FileLock {
 public:
  // Does not wait. FAILED_PRECONDITION when the lock is held already.
  static absl::StatusOr<FileLock> Acquire(const std::string& path);

  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

  // Removes the file; the lock is still held.
  absl::Status RemoveFile();

 private:
  FileLock(std::string path, int fd);

  std::string path_;
  int fd_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_FILE_LOCK_H_
