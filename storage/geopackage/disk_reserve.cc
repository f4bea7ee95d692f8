#include "storage/geopackage/disk_reserve.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "storage/sqlite/durable_file.h"

namespace hypermap::storage {
namespace {

// With less than this, SQLite may fail at files that it makes or enlarges for itself, which it does
// not report as a full disk.
constexpr int64_t kLittleSpace = int64_t{1} << 20;
constexpr int64_t kBytesOfBlock = 512;  // of stat::st_blocks

// The allocated bytes of a file, 0 if there is none.
int64_t AllocatedBytes(const std::string& path) {
  struct stat status;
  if (lstat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return 0;
  return std::min<int64_t>(status.st_size, status.st_blocks * kBytesOfBlock);
}

}  // namespace

DiskReserve::DiskReserve(std::string path, int64_t bytes)
    : path_(std::move(path)), bytes_(std::max<int64_t>(bytes, 0)) {
  const MutexLock lock(&mutex_);
  if (bytes_ == 0) {
    RemoveFile(path_).IgnoreError();
    return;
  }
  size_ = AllocatedBytes(path_);
  if (size_ > bytes_) Resize(bytes_);
}

bool DiskReserve::Keep() {
  const MutexLock lock(&mutex_);
  for (const int64_t wanted : {bytes_, deletion_bytes()}) {
    if (size_ >= wanted) break;
    // Taking the last blocks would make the writes of others fail.
    const bool has_room = AvailableBytes() >= wanted - size_ + bytes_ / 8;
    if (has_room && Resize(wanted)) break;
  }
  return size_ >= bytes_;
}

bool DiskReserve::HasRoom() { return Keep() && AvailableBytes() >= bytes_ / 8; }

bool DiskReserve::Resize(int64_t bytes) {
  const int file = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (file < 0) return false;
  bool done = false;
  if (bytes > size_) {
    done = posix_fallocate(file, 0, bytes) == 0;
    // A failure may have allocated a part.
    if (!done && ftruncate(file, size_) != 0) size_ = 0;
  } else {
    // Some file systems make blocks available only when their release is on disk.
    done = ftruncate(file, bytes) == 0 && fsync(file) == 0;
  }
  close(file);
  if (done) size_ = bytes;
  return done;
}

bool DiskReserve::Release(Purpose purpose) {
  const MutexLock lock(&mutex_);
  const int64_t kept = purpose == Purpose::kHistory ? deletion_bytes() : 0;
  return size_ > kept && Resize(kept);
}

int64_t DiskReserve::AvailableBytes() const {
  struct statvfs status;
  if (statvfs(FolderOf(path_).c_str(), &status) != 0) return 0;
  return static_cast<int64_t>(status.f_bavail) * static_cast<int64_t>(status.f_frsize);
}

bool DiskReserve::NeedsSpace(const absl::Status& status) const {
  if (absl::IsResourceExhausted(status)) return true;
  const bool may_be_full = absl::IsUnavailable(status) || absl::IsFailedPrecondition(status);
  return may_be_full && AvailableBytes() < kLittleSpace;
}

absl::Status DiskReserve::Use(Purpose purpose, absl::FunctionRef<absl::Status()> operation) {
  absl::Status status = operation();
  if (status.ok() || bytes_ == 0 || !NeedsSpace(status) || !Release(purpose)) return status;
  status = operation();
  // The cause may have been another limit than that of the disk.
  Keep();
  return status;
}

}  // namespace hypermap::storage
