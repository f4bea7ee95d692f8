#include "client_libs/cli/file_io.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::cli {
namespace {

constexpr size_t kReadBytes = size_t{1} << 16;

absl::Status FileError(const std::string& path) {
  return absl::ErrnoToStatus(errno, absl::StrCat("file \"", path, "\""));
}

}  // namespace

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return FileError(path);
  const auto closing = absl::MakeCleanup([fd] { close(fd); });
  std::string data;
  while (true) {
    const size_t size = data.size();
    data.resize(size + kReadBytes);
    const ssize_t got = read(fd, data.data() + size, kReadBytes);
    if (got < 0 && errno != EINTR) return FileError(path);
    data.resize(size + (got > 0 ? got : 0));
    if (got == 0) return data;
  }
}

OutputFile::OutputFile(std::string path, std::string temporary_path, int fd)
    : path_(std::move(path)), temporary_path_(std::move(temporary_path)), fd_(fd) {}

absl::StatusOr<std::unique_ptr<OutputFile>> OutputFile::Create(const std::string& path) {
  std::string temporary_path = absl::StrCat(path, ".part-", getpid());
  const int fd = open(temporary_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) return FileError(path);
  return std::unique_ptr<OutputFile>(new OutputFile(path, std::move(temporary_path), fd));
}

OutputFile::~OutputFile() {
  if (fd_ < 0) return;
  close(fd_);
  unlink(temporary_path_.c_str());
}

absl::Status OutputFile::Append(absl::string_view data) {
  while (!data.empty()) {
    const ssize_t written = write(fd_, data.data(), data.size());
    if (written < 0 && errno != EINTR) return FileError(path_);
    if (written > 0) data.remove_prefix(written);
  }
  return absl::OkStatus();
}

absl::Status OutputFile::Commit() {
  if (fsync(fd_) != 0 || rename(temporary_path_.c_str(), path_.c_str()) != 0) {
    return FileError(path_);
  }
  close(fd_);
  fd_ = -1;
  return absl::OkStatus();
}

absl::Status WriteFile(const std::string& path, absl::string_view data) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<OutputFile> file, OutputFile::Create(path));
  HYPERMAP_RETURN_IF_ERROR(file->Append(data));
  return file->Commit();
}

}  // namespace hypermap::cli
