// Locks between processes.
#ifndef HYPERMAP_STORAGE_SQLITE_FILE_LOCK_H_
#define HYPERMAP_STORAGE_SQLITE_FILE_LOCK_H_

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// An exclusive flock(2) on a file made for that purpose. It is released when the object is
// destroyed or the process ends, also when that is killed. Two locks on one path exclude each other
// within a process as well. The file can hold a few bytes for its owner, which stay when the lock
// is released.
class FileLock {
 public:
  // Does not wait. FAILED_PRECONDITION when the lock is held already.
  static absl::StatusOr<FileLock> Acquire(const std::string& path);

  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

  // Removes the file; the lock is still held.
  absl::Status RemoveFile();

  // The first `max_bytes` bytes of the file, or all if there are fewer.
  absl::StatusOr<std::string> Read(size_t max_bytes) const;
  // Overwrites the beginning of the file, without waiting for the disk.
  absl::Status Write(absl::string_view bytes);
  // Makes what was written durable.
  absl::Status Sync();

 private:
  FileLock(std::string path, int fd);

  std::string path_;
  int fd_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_FILE_LOCK_H_
