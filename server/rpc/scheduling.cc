#include "server/rpc/scheduling.h"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace hypermap::server {
namespace {

// The shortest slice that the kernel grants. Its default is some milliseconds.
constexpr uint64_t kSlice_ns = 100'000;

// The first version of struct sched_attr, which the C library does not declare (sched_setattr(2)).
struct SchedulingAttributes {
  uint32_t size = sizeof(SchedulingAttributes);
  uint32_t policy = SCHED_OTHER;
  uint64_t flags = 0;
  int32_t niceness = 0;
  uint32_t priority = 0;
  uint64_t slice_ns = 0;
  uint64_t deadline_ns = 0;
  uint64_t period_ns = 0;
};

}  // namespace

void ScheduleLongWork(int niceness) {
  SchedulingAttributes attributes;
  const int now = getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
  attributes.niceness = niceness == 0 ? now : std::max(niceness, now);
  attributes.slice_ns = kSlice_ns;
  // The C library has no wrapper. Failure is not an error: everything works as well without.
  syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace hypermap::server
