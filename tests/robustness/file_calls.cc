#include "tests/robustness/file_calls.h"

#include <fcntl.h>
#include <linux/seccomp.h>
#include <sys/syscall.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>

#include "absl/strings/str_cat.h"

namespace hypermap::robustness {
namespace {

constexpr CallSpec kCalls[] = {
#ifdef SYS_open
    // Machines that came later than x86-64 have only the calls that are relative to a folder.
    {SYS_open, FileCall::kOpen, -1, 0},
    {SYS_creat, FileCall::kOpen, -1, 0},
    {SYS_rename, FileCall::kRename, -1, 0, -1, 1},
    {SYS_link, FileCall::kLink, -1, 0, -1, 1},
    {SYS_unlink, FileCall::kRemove, -1, 0},
    {SYS_rmdir, FileCall::kRemove, -1, 0},
    {SYS_mkdir, FileCall::kMakeFolder, -1, 0},
    {SYS_stat, FileCall::kStat, -1, 0},
    {SYS_lstat, FileCall::kStat, -1, 0},
    {SYS_access, FileCall::kStat, -1, 0},
#endif
#ifdef SYS_renameat
    {SYS_renameat, FileCall::kRename, 0, 1, 2, 3},
#endif
    {SYS_openat, FileCall::kOpen, 0, 1},
    {SYS_read, FileCall::kRead, 0},
    {SYS_pread64, FileCall::kRead, 0},
    {SYS_readv, FileCall::kRead, 0},
    {SYS_preadv, FileCall::kRead, 0},
    {SYS_write, FileCall::kWrite, 0},
    {SYS_pwrite64, FileCall::kWrite, 0},
    {SYS_writev, FileCall::kWrite, 0},
    {SYS_pwritev, FileCall::kWrite, 0},
    {SYS_truncate, FileCall::kTruncate, -1, 0},
    {SYS_ftruncate, FileCall::kTruncate, 0},
    {SYS_fallocate, FileCall::kAllocate, 0},
    {SYS_fsync, FileCall::kSync, 0},
    {SYS_fdatasync, FileCall::kSync, 0},
    {SYS_copy_file_range, FileCall::kCopy, 2},
    {SYS_sendfile, FileCall::kCopy, 0},
    {SYS_renameat2, FileCall::kRename, 0, 1, 2, 3},
    {SYS_linkat, FileCall::kLink, 0, 1, 2, 3},
    {SYS_unlinkat, FileCall::kRemove, 0, 1},
    {SYS_mkdirat, FileCall::kMakeFolder, 0, 1},
    {SYS_getdents64, FileCall::kList, 0},
    {SYS_newfstatat, FileCall::kStat, 0, 1},
    {SYS_fstat, FileCall::kStat, 0},
    {SYS_statx, FileCall::kStat, 0, 1},
    {SYS_faccessat, FileCall::kStat, 0, 1},
    {SYS_faccessat2, FileCall::kStat, 0, 1},
    {SYS_flock, FileCall::kLock, 0},
    {SYS_fcntl, FileCall::kLock, 0},
    {SYS_mmap, FileCall::kMap, 4},
};

constexpr std::array<const char*, kNumFileCalls> kCallNames = {
    "open", "read",        "write", "truncate", "allocate", "sync", "copy", "rename",
    "link", "remove file", "mkdir", "list",     "stat",     "lock", "mmap"};

// Loads the low half of an argument. REQUIRES: a little-endian machine.
sock_filter LoadArgument(int index) {
  const auto at = static_cast<uint32_t>(offsetof(seccomp_data, args) + sizeof(uint64_t) * index);
  return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, at);
}

}  // namespace

std::string NameOf(FileCall call) { return kCallNames[static_cast<size_t>(call)]; }

absl::Span<const CallSpec> SeenCalls() { return kCalls; }

const CallSpec* FindCall(int64_t number) {
  const auto* found = std::find_if(std::begin(kCalls), std::end(kCalls),
                                   [=](const CallSpec& spec) { return spec.number == number; });
  return found == std::end(kCalls) ? nullptr : found;
}

std::vector<int> ErrorsOf(FileCall call) {
  switch (call) {
    case FileCall::kOpen:
      return {EIO, EMFILE};
    case FileCall::kWrite:
    case FileCall::kAllocate:
    case FileCall::kCopy:
    case FileCall::kRename:
    case FileCall::kLink:
    case FileCall::kMakeFolder:
      return {EIO, ENOSPC};
    case FileCall::kLock:
      return {ENOLCK};
    case FileCall::kMap:
      return {ENOMEM};
    default:
      return {EIO};
  }
}

std::string ErrorName(int error) {
  const char* name = strerrorname_np(error);
  return name != nullptr ? name : absl::StrCat(error);
}

bool ChangesDisk(FileCall call, bool for_writing) {
  switch (call) {
    case FileCall::kOpen:
      return for_writing;
    case FileCall::kWrite:
    case FileCall::kTruncate:
    case FileCall::kAllocate:
    case FileCall::kSync:
    case FileCall::kCopy:
    case FileCall::kRename:
    case FileCall::kLink:
    case FileCall::kRemove:
    case FileCall::kMakeFolder:
      return true;
    default:
      return false;
  }
}

bool TakesSpace(FileCall call, bool for_writing) {
  return ChangesDisk(call, for_writing) && call != FileCall::kSync && call != FileCall::kRemove &&
         call != FileCall::kTruncate && call != FileCall::kRename;
}

std::vector<sock_filter> MakeFilter() {
  std::vector<sock_filter> filter;
  const auto number = static_cast<uint32_t>(offsetof(seccomp_data, nr));
  const sock_filter notify = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF);
  const sock_filter allow = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  filter.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, number));
  for (const CallSpec& spec : kCalls) {
    const auto call = static_cast<uint32_t>(spec.number);
    if (spec.number == SYS_fcntl) {
      // Of its commands only those that take or release a lock.
      filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 5));
      filter.push_back(LoadArgument(1));
      filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, F_SETLK, 1, 0));
      filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, F_SETLKW, 0, 1));
      filter.push_back(notify);
      filter.push_back(allow);
    } else if (spec.number == SYS_mmap) {
      filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 4));
      filter.push_back(LoadArgument(4));
      filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0xffffffff, 0, 1));
      filter.push_back(allow);
      filter.push_back(notify);
    } else {
      filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1));
      filter.push_back(notify);
    }
  }
  filter.push_back(allow);
  return filter;
}

}  // namespace hypermap::robustness
