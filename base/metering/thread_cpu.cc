#include "base/metering/thread_cpu.h"

#include <time.h>

namespace hypermap {

absl::Duration ThreadCpuTime() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return absl::DurationFromTimespec(used);
}

}  // namespace hypermap
