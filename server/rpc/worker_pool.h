// Threads that carry out requests, so that gRPC's own threads are not held up.
#ifndef HYPERMAP_SERVER_RPC_WORKER_POOL_H_
#define HYPERMAP_SERVER_RPC_WORKER_POOL_H_

#include <deque>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Runs tasks in the order in which they come, as many at a time as there are threads. The queue is
// not bounded: it has about one task for each request in flight. Thread safe.
class WorkerPool {
 public:
  using Task = absl::AnyInvocable<void() &&>;

  explicit WorkerPool(int num_threads);
  // Runs the queued tasks, then joins the threads.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  void Run(Task task);

 private:
  void Work();
  // Waits for a task; returns null when the pool ends.
  Task Take();

  Mutex mutex_;
  CondVar changed_;
  std::deque<Task> tasks_ ABSL_GUARDED_BY(mutex_);
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WORKER_POOL_H_
