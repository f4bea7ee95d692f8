// Runs a number of tasks on several threads.
#ifndef HYPERMAP_BASE_SYNC_PARALLEL_H_
#define HYPERMAP_BASE_SYNC_PARALLEL_H_

#include <cstddef>

#include "absl/functional/function_ref.h"
#include "base/sync/thread_name.h"

namespace hypermap {

// Calls run(i) once for each i in [0, num_tasks), in any order, and returns when all calls have
// returned. Up to `max_threads` threads make the calls, one of them the caller's; fewer if the
// system has no more.
void RunInParallel(ThreadName name, size_t max_threads, size_t num_tasks,
                   absl::FunctionRef<void(size_t)> run);

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_PARALLEL_H_
