#include "storage/sqlite/paced_writes.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>

namespace hypermap::storage {
namespace {

thread_local int unpaced = 0;    // how many UnpacedWrites live on this thread
thread_local PacedWrites paced;  // the writes of SQLite on this thread

// Called by SQLite in place of the function of the system.
ssize_t PacedPwrite(int fd, const void* bytes, size_t size, off_t offset) {
  const ssize_t written = pwrite(fd, bytes, size, offset);
  if (written <= 0 || unpaced > 0) return written;
  const int error = paced.Wrote(fd, written);
  if (error == 0) return written;
  errno = error;
  return -1;
}

}  // namespace

int PacedWrites::Wrote(int fd, int64_t bytes) {
  if (fd != fd_) {
    fd_ = fd;
    piece_bytes_ = 0;
  }
  piece_bytes_ += bytes;
  if (piece_bytes_ < kPieceBytes) return 0;
  piece_bytes_ = 0;
  constexpr int kWriteAndWait =
      SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER;
  if (sync_file_range(fd, 0, 0, kWriteAndWait) == 0) return 0;
  // Not a file on a disk, or a file system that can't do this.
  const bool can_not = errno == ESPIPE || errno == EINVAL || errno == ENOSYS || errno == EOPNOTSUPP;
  return can_not ? 0 : errno;
}

UnpacedWrites::UnpacedWrites() { ++unpaced; }

UnpacedWrites::~UnpacedWrites() { --unpaced; }

void SqliteHasSynced() { paced.Synced(); }

void PaceWritesOfSqlite() {
  sqlite3_vfs* const files = sqlite3_vfs_find("unix");
  if (files == nullptr || files->xSetSystemCall == nullptr) return;
  // SQLite is built with one of the two, and does not use the other.
  static_assert(sizeof(off_t) == 8);
  const auto call = reinterpret_cast<sqlite3_syscall_ptr>(PacedPwrite);
  files->xSetSystemCall(files, "pwrite64", call);
  files->xSetSystemCall(files, "pwrite", call);
}

}  // namespace hypermap::storage
