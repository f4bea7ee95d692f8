#include "base/admission/thread_limit.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <system_error>

#include "absl/strings/str_cat.h"

namespace hypermap::admission {
namespace {

constexpr int64_t kUnlimited = std::numeric_limits<int64_t>::max();

// The threads of a process; 0 if it has ended.
int64_t ThreadsOf(const std::string& process) {
  std::ifstream status(absl::StrCat(process, "/status"));
  for (std::string word; status >> word;) {
    int64_t threads = 0;
    if (word == "Threads:" && status >> threads) return threads;
  }
  return 0;
}

// The threads of all processes of the user but this one.
int64_t ThreadsOfOthers(const std::string& proc_root) {
  const std::string self = std::to_string(getpid());
  int64_t threads = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(proc_root, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    struct stat about;
    if (name.find_first_not_of("0123456789") != std::string::npos || name == self) continue;
    if (stat(entry->path().c_str(), &about) != 0 || about.st_uid != getuid()) continue;
    threads += ThreadsOf(entry->path());
  }
  return threads;
}

int64_t LimitOfUser(const std::string& proc_root) {
  rlimit limit;
  if (getuid() == 0 || getrlimit(RLIMIT_NPROC, &limit) != 0) return kUnlimited;
  limit.rlim_cur = limit.rlim_max;
  // Can't fail: raising the soft limit needs no privilege.
  setrlimit(RLIMIT_NPROC, &limit);
  if (limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  return std::max<int64_t>(static_cast<int64_t>(limit.rlim_cur) - ThreadsOfOthers(proc_root), 0);
}

// The first number in the file; -1 if there is none.
int64_t ReadNumber(const std::string& path) {
  std::ifstream file(path);
  int64_t number = 0;
  return file >> number ? number : -1;
}

int64_t LimitOfGroup(const std::string& group, const std::string& proc_root) {
  const int64_t limit = ReadNumber(absl::StrCat(group, "/pids.max"));
  const int64_t current = ReadNumber(absl::StrCat(group, "/pids.current"));
  if (limit < 0 || current < 0) return kUnlimited;
  return std::max<int64_t>(limit - current + ThreadsOf(absl::StrCat(proc_root, "/self")), 0);
}

}  // namespace

int64_t ThreadLimit(const std::string& cgroup_root, const std::string& proc_root) {
  // The two folders are those of version 2 and of version 1 of control groups. In a container, the
  // process's own group is mounted there.
  return std::min({LimitOfUser(proc_root), LimitOfGroup(cgroup_root, proc_root),
                   LimitOfGroup(absl::StrCat(cgroup_root, "/pids"), proc_root)});
}

}  // namespace hypermap::admission
