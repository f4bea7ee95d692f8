#include "storage/sqlite/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/sqlite/durable_file.h"

namespace hypermap::storage {
namespace {

// Returns whether the path still names the file that was opened; an owner may have removed it
// meanwhile.
absl::StatusOr<bool> StillNames(const std::string& path, int fd) {
  struct stat by_path;
  struct stat by_fd;
  if (stat(path.c_str(), &by_path) != 0) {
    if (errno == ENOENT) return false;
    return FileError(errno, absl::StrCat("cannot look for ", path));
  }
  if (fstat(fd, &by_fd) != 0) return FileError(errno, absl::StrCat("cannot look at ", path));
  return by_path.st_dev == by_fd.st_dev && by_path.st_ino == by_fd.st_ino;
}

}  // namespace

FileLock::FileLock(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}

FileLock::FileLock(FileLock&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

FileLock::~FileLock() {
  if (fd_ >= 0) close(fd_);
}

absl::StatusOr<FileLock> FileLock::Acquire(const std::string& path) {
  while (true) {
    const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (fd < 0) return FileError(errno, absl::StrCat("cannot open ", path));
    FileLock lock(path, fd);
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
      if (errno == EINTR) continue;
      if (errno == EWOULDBLOCK) {
        return absl::FailedPreconditionError(absl::StrCat(path, " is locked by another process"));
      }
      return FileError(errno, absl::StrCat("cannot lock ", path));
    }
    HYPERMAP_ASSIGN_OR_RETURN(const bool is_current, StillNames(path, fd));
    if (is_current) return lock;
  }
}

absl::Status FileLock::RemoveFile() { return storage::RemoveFile(path_); }

absl::StatusOr<std::string> FileLock::Read(size_t max_bytes) const {
  std::string bytes(max_bytes, '\0');
  const ssize_t size = pread(fd_, bytes.data(), bytes.size(), 0);
  if (size < 0) return FileError(errno, absl::StrCat("cannot read ", path_));
  bytes.resize(static_cast<size_t>(size));
  return bytes;
}

absl::Status FileLock::Write(absl::string_view bytes) {
  const ssize_t size = pwrite(fd_, bytes.data(), bytes.size(), 0);
  if (size == static_cast<ssize_t>(bytes.size())) return absl::OkStatus();
  return FileError(size < 0 ? errno : ENOSPC, absl::StrCat("cannot write ", path_));
}

absl::Status FileLock::Sync() {
  if (fsync(fd_) == 0) return absl::OkStatus();
  return FileError(errno, absl::StrCat("cannot sync ", path_));
}

}  // namespace hypermap::storage
