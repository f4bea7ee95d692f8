// The memory of the machine and of this process, in bytes.
#ifndef HYPERMAP_BASE_ADMISSION_MEMORY_H_
#define HYPERMAP_BASE_ADMISSION_MEMORY_H_

#include <cstdint>
#include <string>

namespace hypermap::admission {

// Memory that this process may use: that of the machine, or of its control group if that is less.
// `cgroup_root` is where control groups are mounted.
int64_t UsableMemory(const std::string& cgroup_root = "/sys/fs/cgroup");

// Address space that this process may use (ulimit -v); 0 if it is not limited.
int64_t AddressSpaceLimit();

// Address space that a thread takes for its stack.
int64_t StackBytes();

// Memory of this process that is in RAM; 0 if the system does not tell.
int64_t ResidentMemory();

// Returns memory that was freed to the system, after work that needed much. Takes milliseconds for
// each gigabyte, in which other threads may wait for memory.
void ReturnFreedMemory();

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_MEMORY_H_
