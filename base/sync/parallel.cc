#include "base/sync/parallel.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "base/sync/start_thread.h"

namespace hypermap {

void RunInParallel(ThreadName name, size_t max_threads, size_t num_tasks,
                   absl::FunctionRef<void(size_t)> run) {
  std::atomic<size_t> next = 0;
  const auto run_some = [&] {
    for (size_t i = next++; i < num_tasks; i = next++) run(i);
  };
  std::vector<std::thread> threads;
  while (threads.size() + 1 < std::min(max_threads, num_tasks)) {
    absl::StatusOr<std::thread> thread = StartThread(name, run_some);
    if (!thread.ok()) break;
    threads.push_back(*std::move(thread));
  }
  run_some();
  for (std::thread& thread : threads) thread.join();
}

}  // namespace hypermap
