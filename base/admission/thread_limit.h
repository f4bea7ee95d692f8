// The number of threads that the process may have.
#ifndef HYPERMAP_BASE_ADMISSION_THREAD_LIMIT_H_
#define HYPERMAP_BASE_ADMISSION_THREAD_LIMIT_H_

#include <cstdint>
#include <string>

namespace hypermap::admission {

// Raises the soft limit of the user's threads (ulimit -u) to the hard one, and returns the number
// of threads that this process may have: that limit, which does not hold for the user root, and the
// one of the control group (pids.max), each without what other processes have of it now. A very
// large number if there is no limit. `cgroup_root` is where control groups are mounted, and
// `proc_root` the file system of processes.
int64_t ThreadLimit(const std::string& cgroup_root = "/sys/fs/cgroup",
                    const std::string& proc_root = "/proc");

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_THREAD_LIMIT_H_
