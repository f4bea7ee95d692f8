#include "base/access/access_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::access {
namespace {

constexpr mode_t kMode = 0640;

absl::Status ErrorOf(absl::string_view action, const std::string& path) {
  return absl::ErrnoToStatus(errno, absl::StrCat("cannot ", action, " ", path));
}

absl::StatusOr<std::string> ReadAll(int fd, const std::string& path) {
  std::string text;
  char buffer[4096];
  while (true) {
    const ssize_t count = read(fd, buffer, sizeof buffer);
    if (count < 0) return ErrorOf("read", path);
    if (count == 0) return text;
    text.append(buffer, static_cast<size_t>(count));
  }
}

absl::Status WriteAll(int fd, absl::string_view text, const std::string& path) {
  while (!text.empty()) {
    const ssize_t count = write(fd, text.data(), text.size());
    if (count < 0) return ErrorOf("write", path);
    text.remove_prefix(static_cast<size_t>(count));
  }
  return fsync(fd) == 0 ? absl::OkStatus() : ErrorOf("sync", path);
}

std::string FolderOf(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

absl::Status SyncFolder(const std::string& folder) {
  const int fd = open(folder.c_str(), O_DIRECTORY | O_RDONLY | O_CLOEXEC);
  if (fd < 0) return ErrorOf("open", folder);
  absl::Status status = fsync(fd) == 0 ? absl::OkStatus() : ErrorOf("sync", folder);
  close(fd);
  return status;
}

// Replaces the file by one with this text, the owner and the mode of the old file.
absl::Status Replace(const std::string& path, absl::string_view text) {
  const std::string temporary = absl::StrCat(path, ".new");
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  if (fd < 0) return ErrorOf("write", temporary);
  absl::Cleanup remove = [&] { unlink(temporary.c_str()); };
  struct stat old;
  if (stat(path.c_str(), &old) == 0 &&
      (fchown(fd, old.st_uid, old.st_gid) != 0 || fchmod(fd, old.st_mode & 0777) != 0)) {
    const absl::Status status = ErrorOf("keep the owner of", path);
    close(fd);
    return status;
  }
  const absl::Status written = WriteAll(fd, text, temporary);
  close(fd);
  HYPERMAP_RETURN_IF_ERROR(written);
  if (rename(temporary.c_str(), path.c_str()) != 0) return ErrorOf("replace", path);
  std::move(remove).Cancel();
  return SyncFolder(FolderOf(path));
}

}  // namespace

absl::StatusOr<AccessTable> ReadAccessFile(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return ErrorOf("open", path);
  const absl::Cleanup close_it = [fd] { close(fd); };
  struct stat status;
  if (fstat(fd, &status) != 0) return ErrorOf("read", path);
  if ((status.st_mode & S_IWOTH) != 0) {
    return absl::InvalidArgumentError(absl::StrCat(path, " may be written by all users"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadAll(fd, path));
  absl::StatusOr<AccessTable> table = AccessTable::Parse(text);
  if (!table.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", table.status().message()));
  }
  return table;
}

absl::Status ChangeAccessFile(const std::string& path,
                              absl::FunctionRef<absl::Status(AccessTable&)> change) {
  // The lock is on a file of its own, because the other one is replaced.
  const std::string lock = absl::StrCat(path, ".lock");
  const int fd = open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode);
  if (fd < 0) return ErrorOf("open", lock);
  const absl::Cleanup unlock = [fd] { close(fd); };
  if (flock(fd, LOCK_EX) != 0) return ErrorOf("lock", lock);
  absl::StatusOr<AccessTable> table = ReadAccessFile(path);
  if (absl::IsNotFound(table.status())) table = AccessTable();
  HYPERMAP_RETURN_IF_ERROR(table.status());
  HYPERMAP_RETURN_IF_ERROR(change(*table));
  return Replace(path, table->Format());
}

}  // namespace hypermap::access
