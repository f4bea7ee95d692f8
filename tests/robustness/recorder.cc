#include "tests/robustness/recorder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::robustness {

using storage::FileEvent;

namespace {

std::string ProcPath(const SeenCall& call, uint64_t fd, const char* kind) {
  return absl::StrCat("/proc/", call.thread, "/", kind, "/", static_cast<int>(fd));
}

// The position of an open file.
int64_t PositionOf(const SeenCall& call, uint64_t fd) {
  std::ifstream info(ProcPath(call, fd, "fdinfo"));
  std::string word;
  int64_t position = 0;
  info >> word >> position;
  return position;
}

int64_t SizeOf(const SeenCall& call, uint64_t fd) {
  struct stat status {};
  return stat(ProcPath(call, fd, "fd").c_str(), &status) == 0 ? status.st_size : 0;
}

std::string ReadPart(const std::string& path, int64_t offset, int64_t size) {
  std::string bytes(static_cast<size_t>(std::max<int64_t>(size, 0)), '\0');
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const ssize_t read = fd < 0 ? 0 : pread(fd, bytes.data(), bytes.size(), offset);
  if (fd >= 0) close(fd);
  bytes.resize(static_cast<size_t>(std::max<ssize_t>(read, 0)));
  return bytes;
}

// The bytes of a write of several buffers.
std::string ReadVector(const SeenCall& call) {
  const auto count = static_cast<size_t>(call.arguments[2]);
  const auto raw = ReadMemory(call.thread, call.arguments[1], count * sizeof(iovec));
  std::string bytes;
  for (size_t i = 0; raw && i < count; ++i) {
    iovec part{};
    memcpy(&part, raw->data() + i * sizeof(iovec), sizeof(iovec));
    bytes += ReadMemory(call.thread, reinterpret_cast<uint64_t>(part.iov_base), part.iov_len)
                 .value_or("");
  }
  return bytes;
}

// The position for a copy within the kernel: at an address, or that of the file if that is null.
int64_t PositionAt(const SeenCall& call, uint64_t address, uint64_t fd) {
  if (address == 0) return PositionOf(call, fd);
  int64_t position = 0;
  const auto raw = ReadMemory(call.thread, address, sizeof(position));
  if (raw) memcpy(&position, raw->data(), sizeof(position));
  return position;
}

}  // namespace

Recorder::Recorder(std::string folder) : folder_(std::move(folder)) {
  for (const auto& [name, bytes] : ReadTree(folder_)) {
    const bool is_folder = name.ends_with("/");
    const std::string plain = is_folder ? name.substr(0, name.size() - 1) : name;
    names_[plain] = is_folder ? -1 : num_files_++;
    Append(Kind::kAppear, names_[plain], plain).bytes = bytes;
  }
}

FileEvent& Recorder::Append(Kind kind, int file, const std::string& name) {
  FileEvent& event = events_.emplace_back();
  event.kind = kind;
  event.file = file;
  event.name = name;
  return event;
}

int Recorder::FileOf(const std::string& name) const {
  const auto found = names_.find(name);
  return found == names_.end() ? -1 : found->second;
}

void Recorder::AddNote(int64_t number) { Append(Kind::kNote, -1, "").offset = number; }

void Recorder::Add(const SeenCall& call, const Answer& answer) {
  if (call.call == FileCall::kSync) {
    AddSync(call, answer);
    return;
  }
  const bool half = answer.kind == Answer::Kind::kHalf;
  if (answer.kind != Answer::Kind::kPass && !half) return;
  switch (call.call) {
    case FileCall::kOpen:
      AddOpen(call);
      break;
    case FileCall::kWrite:
      AddWrite(call, half);
      break;
    case FileCall::kCopy:
      AddCopy(call);
      break;
    case FileCall::kTruncate:
    case FileCall::kAllocate:
      AddResize(call);
      break;
    case FileCall::kRename:
      AddMove(call);
      break;
    case FileCall::kLink:
      if (FileOf(call.path) < 0 || names_.contains(call.other)) break;
      names_[call.other] = FileOf(call.path);
      Append(Kind::kLink, FileOf(call.path), call.other);
      break;
    case FileCall::kRemove:
      AddRemoval(call);
      break;
    case FileCall::kMakeFolder:
      if (names_.contains(call.path) || call.path.empty()) break;
      names_[call.path] = -1;
      Append(Kind::kMakeFolder, -1, call.path);
      break;
    default:
      break;
  }
}

void Recorder::AddOpen(const SeenCall& call) {
  const bool at = call.number == SYS_openat;
  const uint64_t flags = call.arguments[at ? 2 : 1];
  if (!names_.contains(call.path)) {
    if ((flags & O_CREAT) == 0 || call.path.empty()) return;
    names_[call.path] = num_files_;
    Append(Kind::kCreate, num_files_++, call.path);
  } else if ((flags & O_TRUNC) != 0 && (flags & O_EXCL) == 0 && FileOf(call.path) >= 0) {
    Append(Kind::kTruncate, FileOf(call.path), "");
  }
}

void Recorder::AddWrite(const SeenCall& call, bool half) {
  const int file = FileOf(call.path);
  if (file < 0) return;
  FileEvent event;
  event.kind = Kind::kWrite;
  event.file = file;
  const uint64_t fd = call.arguments[0];
  const bool has_offset = call.number == SYS_pwrite64 || call.number == SYS_pwritev;
  event.offset = has_offset ? static_cast<int64_t>(call.arguments[3]) : PositionOf(call, fd);
  if (call.number == SYS_writev || call.number == SYS_pwritev) {
    event.bytes = ReadVector(call);
  } else {
    const auto size = static_cast<size_t>(call.arguments[2]);
    event.bytes = ReadMemory(call.thread, call.arguments[1], half ? size / 2 : size).value_or("");
  }
  events_.push_back(std::move(event));
}

void Recorder::AddCopy(const SeenCall& call) {
  const int file = FileOf(call.path);
  if (file < 0) return;
  const bool range = call.number == SYS_copy_file_range;
  const uint64_t from = call.arguments[range ? 0 : 1];
  const uint64_t to = call.arguments[range ? 2 : 0];
  const int64_t begin = PositionAt(call, call.arguments[range ? 1 : 2], from);
  const auto count = static_cast<int64_t>(call.arguments[range ? 4 : 3]);
  FileEvent event;
  event.kind = Kind::kWrite;
  event.file = file;
  event.offset = PositionAt(call, range ? call.arguments[3] : 0, to);
  event.bytes =
      ReadPart(ProcPath(call, from, "fd"), begin, std::min(count, SizeOf(call, from) - begin));
  if (!event.bytes.empty()) events_.push_back(std::move(event));
}

void Recorder::AddResize(const SeenCall& call) {
  const int file = FileOf(call.path);
  if (file < 0) return;
  auto size = static_cast<int64_t>(call.arguments[1]);
  if (call.call == FileCall::kAllocate) {
    const auto end = static_cast<int64_t>(call.arguments[2] + call.arguments[3]);
    size = std::max(SizeOf(call, call.arguments[0]), end);
  }
  Append(Kind::kTruncate, file, "").offset = size;
}

void Recorder::AddSync(const SeenCall& call, const Answer& answer) {
  if (answer.kind == Answer::Kind::kPretend) return;
  const bool fails = answer.kind == Answer::Kind::kFail;
  if (call.is_folder) {
    if (!fails) Append(Kind::kSyncFolder, -1, call.path);
  } else if (FileOf(call.path) >= 0) {
    Append(fails ? Kind::kSyncFailed : Kind::kSync, FileOf(call.path), "");
  }
}

void Recorder::AddMove(const SeenCall& call) {
  if (call.number == SYS_renameat2 && (call.arguments[4] & RENAME_EXCHANGE) != 0) {
    AddExchange(call);
    return;
  }
  if (!names_.contains(call.path) || call.path == call.other) return;
  std::map<std::string, int> moved;
  for (auto it = names_.lower_bound(call.path); it != names_.end();) {
    const bool is_within = it->first == call.path || it->first.starts_with(call.path + "/");
    if (!is_within) {
      ++it;
      continue;
    }
    moved[call.other + it->first.substr(call.path.size())] = it->second;
    it = names_.erase(it);
  }
  for (const auto& [name, file] : moved) names_[name] = file;
  Append(Kind::kMove, FileOf(call.other), call.other).from = call.path;
}

void Recorder::AddExchange(const SeenCall& call) {
  if (FileOf(call.path) < 0 || FileOf(call.other) < 0) return;
  std::swap(names_[call.path], names_[call.other]);
  Append(Kind::kExchange, FileOf(call.other), call.other).from = call.path;
}

void Recorder::AddRemoval(const SeenCall& call) {
  const auto found = names_.find(call.path);
  if (found == names_.end()) return;
  bool removes_folder = call.number == SYS_unlinkat && (call.arguments[2] & AT_REMOVEDIR) != 0;
#ifdef SYS_rmdir
  removes_folder = removes_folder || call.number == SYS_rmdir;
#endif
  const bool is_folder = found->second < 0;
  const auto next = std::next(found);
  const bool is_empty = next == names_.end() || !next->first.starts_with(call.path + "/");
  if (is_folder != removes_folder || (is_folder && !is_empty)) return;
  names_.erase(found);
  Append(Kind::kRemove, -1, call.path);
}

FileTree ReadTree(const std::string& folder) {
  FileTree files;
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, error)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (entry.is_directory()) {
      files[name + "/"] = "";
      continue;
    }
    std::ifstream in(entry.path(), std::ios::binary);
    files[name] = {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  return files;
}

void WriteTree(const FileTree& files, const std::string& folder) {
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  std::filesystem::create_directories(folder, error);
  constexpr size_t kLong = 4096;
  std::map<absl::string_view, std::string> written;
  for (const auto& [name, bytes] : files) {
    const std::string path = absl::StrCat(folder, "/", name);
    if (name.ends_with("/")) {
      std::filesystem::create_directories(path, error);
    } else {
      std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
      if (bytes.size() >= kLong) {
        const auto [known, is_new] = written.emplace(bytes, path);
        if (!is_new && link(known->second.c_str(), path.c_str()) == 0) continue;
      }
      std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    }
  }
}

}  // namespace hypermap::robustness
