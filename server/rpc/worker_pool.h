// Threads that carry out requests, so that gRPC's own threads are not held up.
#ifndef HYPERMAP_SERVER_RPC_WORKER_POOL_H_
#define HYPERMAP_SERVER_RPC_WORKER_POOL_H_

#include <deque>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/functional/any_invocable.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Runs as many tasks at a time as there are threads. Clients take turns: the next task is of the
// client that has waited longest for its turn, and the tasks of one client run in the order in
// which they come. A client whose next task is about a busy subject is passed over. The queue is
// not bounded: it has about one task for each request in flight. Thread safe.
class WorkerPool {
 public:
  using Task = absl::AnyInvocable<void() &&>;

  // The threads run at this niceness (nice(7)): a greater one leaves more of the processors to the
  // threads of other pools.
  explicit WorkerPool(int num_threads, int niceness = 0);
  // Runs the queued tasks, then joins the threads.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // `client` identifies the connection for which the task is. Tasks about the same `subject` run
  // one at a time, so that none holds a thread while it waits for another; "" is no subject.
  void Run(absl::string_view client, absl::string_view subject, Task task);
  void Run(absl::string_view client, Task task) { Run(client, "", std::move(task)); }
  // Runs a task of the server itself.
  void Run(Task task) { Run("", std::move(task)); }

 private:
  struct Queued {
    std::string subject;
    Task task;
  };

  void Work();
  // Waits for a task; one without a task means that the pool ends. The subject is busy until Ended.
  Queued Take();
  void Ended(const std::string& subject);
  // Returns the first turn whose task can run.
  std::deque<std::string>::iterator FindTurn() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Mutex mutex_;
  CondVar changed_;
  // The queued tasks of each client that has any, and these clients in the order of their turns.
  absl::flat_hash_map<std::string, std::deque<Queued>> tasks_ ABSL_GUARDED_BY(mutex_);
  std::deque<std::string> turns_ ABSL_GUARDED_BY(mutex_);
  absl::flat_hash_set<std::string> busy_subjects_ ABSL_GUARDED_BY(mutex_);
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WORKER_POOL_H_
