#include "base/admission/memory.h"

#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace hypermap::admission {

int64_t UsableMemory(const std::string& cgroup_root) {
  int64_t usable = int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE);
  // The first is of version 2 of control groups, the second of version 1. A group without a limit
  // has the word "max" or a huge number there.
  for (const char* name : {"/memory.max", "/memory/memory.limit_in_bytes"}) {
    std::ifstream file(absl::StrCat(cgroup_root, name));
    int64_t limit = 0;
    if (file >> limit && limit > 0) usable = std::min(usable, limit);
  }
  return usable;
}

int64_t AddressSpaceLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return 0;
  return static_cast<int64_t>(limit.rlim_cur);
}

int64_t StackBytes() {
  pthread_attr_t attributes;
  size_t bytes = 0;
  if (pthread_attr_init(&attributes) != 0) return 0;
  pthread_attr_getstacksize(&attributes, &bytes);
  pthread_attr_destroy(&attributes);
  return static_cast<int64_t>(bytes);
}

int64_t ResidentMemory() {
  // Kept open, so that it can be read when the process may open no more files.
  static const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  char text[128];
  const ssize_t size = pread(file, text, sizeof text, 0);
  if (size <= 0) return 0;
  // "total resident ...", in pages.
  const absl::string_view line(text, static_cast<size_t>(size));
  const size_t begin = line.find(' ') + 1;
  int64_t resident_pages = 0;
  if (!absl::SimpleAtoi(line.substr(begin, line.find(' ', begin) - begin), &resident_pages)) {
    return 0;
  }
  return resident_pages * sysconf(_SC_PAGESIZE);
}

void ReturnFreedMemory() { malloc_trim(0); }

}  // namespace hypermap::admission
