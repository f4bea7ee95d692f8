#include "base/admission/memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "absl/strings/str_cat.h"

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

int64_t ResidentMemory() {
  std::ifstream file("/proc/self/statm");
  int64_t total_pages = 0;
  int64_t resident_pages = 0;
  if (!(file >> total_pages >> resident_pages)) return 0;
  return resident_pages * sysconf(_SC_PAGESIZE);
}

void ReturnFreedMemory() { malloc_trim(0); }

}  // namespace hypermap::admission
