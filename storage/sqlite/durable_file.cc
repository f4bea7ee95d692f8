#include "storage/sqlite/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

absl::Status Sync(const std::string& path, int flags) {
  const int fd = open(path.c_str(), flags | O_RDONLY | O_CLOEXEC);
  if (fd < 0) return FileError(errno, absl::StrCat("cannot open ", path));
  absl::Status status;
  if (fsync(fd) != 0) status = FileError(errno, absl::StrCat("cannot sync ", path));
  close(fd);
  return status;
}

// As rename: 0, or -1 and errno.
int ExchangeFiles(const std::string& one, const std::string& other) {
  return renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE);
}

}  // namespace

absl::Status FileError(int error, absl::string_view what) {
  const absl::Status status = absl::ErrnoToStatus(error, what);
  // Such as EIO.
  if (absl::IsUnknown(status)) return absl::UnavailableError(status.message());
  // No other user may write there either, and a disk that was made read-only may be mended.
  if (error == EROFS) return absl::FailedPreconditionError(status.message());
  return status;
}

std::string FolderOf(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

absl::Status MakeFolder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) {
    return absl::FailedPreconditionError(
        absl::StrCat("cannot make the folder ", path, ": ", error.message()));
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> FindPath(const std::string& path) {
  struct stat status;
  if (lstat(path.c_str(), &status) == 0) return true;
  if (errno == ENOENT || errno == ENOTDIR) return false;
  return FileError(errno, absl::StrCat("cannot look for ", path));
}

bool PathExists(const std::string& path) { return FindPath(path).value_or(true); }

absl::Status SyncFolder(const std::string& path) { return Sync(path, O_DIRECTORY); }

absl::Status PublishFile(const std::string& temporary, const std::string& path) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(path));
  if (exists) return absl::AlreadyExistsError(absl::StrCat(path, " exists"));
  HYPERMAP_RETURN_IF_ERROR(Sync(temporary, 0));
  if (rename(temporary.c_str(), path.c_str()) != 0) {
    return FileError(errno, absl::StrCat("cannot rename ", temporary, " to ", path));
  }
  absl::Status status = SyncFolder(FolderOf(path));
  if (status.ok() || rename(path.c_str(), temporary.c_str()) == 0) return status;
  return absl::Status(status.code(), absl::StrCat(status.message(), "; and ", path, " stays"));
}

absl::Status ReplaceFile(const std::string& temporary, const std::string& path) {
  HYPERMAP_RETURN_IF_ERROR(Sync(temporary, 0));
  const bool exchanged = ExchangeFiles(temporary, path) == 0;
  // Not all file systems can exchange names (NFS), and there may be nothing to replace.
  const bool may_rename = !exchanged && (errno == EINVAL || errno == ENOSYS || errno == ENOENT);
  if (!exchanged && (!may_rename || rename(temporary.c_str(), path.c_str()) != 0)) {
    return FileError(errno, absl::StrCat("cannot rename ", temporary, " to ", path));
  }
  const absl::Status status = SyncFolder(FolderOf(path));
  if (status.ok()) {
    // What stays of the earlier file does no harm.
    if (exchanged) unlink(temporary.c_str());
    return status;
  }
  if (exchanged && ExchangeFiles(temporary, path) == 0) return status;
  return absl::Status(status.code(),
                      absl::StrCat(status.message(), "; and ", path, " is replaced"));
}

absl::Status LinkOrCopyFile(const std::string& from, const std::string& to) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(to));
  if (exists) return absl::AlreadyExistsError(absl::StrCat(to, " exists"));
  if (link(from.c_str(), to.c_str()) == 0) return SyncFolder(FolderOf(to));
  std::error_code error;
  std::filesystem::copy_file(from, to, error);
  absl::Status status;
  if (error) status = FileError(error.value(), absl::StrCat("cannot copy ", from, " to ", to));
  if (status.ok()) status = Sync(to, 0);
  if (status.ok()) status = SyncFolder(FolderOf(to));
  if (!status.ok()) unlink(to.c_str());
  return status;
}

absl::Status MoveFile(const std::string& from, const std::string& to) {
  if (rename(from.c_str(), to.c_str()) == 0) return absl::OkStatus();
  const int error = errno;
  HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(from));
  if (!exists) return absl::OkStatus();
  return FileError(error, absl::StrCat("cannot rename ", from, " to ", to));
}

absl::Status RemoveFile(const std::string& path) {
  if (unlink(path.c_str()) == 0 || errno == ENOENT) return absl::OkStatus();
  return FileError(errno, absl::StrCat("cannot remove ", path));
}

}  // namespace hypermap::storage
