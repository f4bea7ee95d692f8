// A queue of tasks that are released together at the next tick of a clock.
#ifndef HYPERMAP_SERVER_WATCH_TICK_QUEUE_H_
#define HYPERMAP_SERVER_WATCH_TICK_QUEUE_H_

#include <deque>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "server/rpc/timer_queue.h"
#include "server/rpc/worker_pool.h"

namespace hypermap::server {

// Holds short tasks until the next tick of a clock that all queues with the same period share, then
// queues them. One worker runs the queue task by task. Threads that are awake anyway may help with
// RunNext, because waking a thread costs as much as the write that a task starts. No thread waits
// for another. Thread safe.
class TickQueue : public std::enable_shared_from_this<TickQueue> {
 public:
  using Task = absl::AnyInvocable<void() &&>;

  // A queue with the period `tick`. A worker that runs it queues again behind other requests after
  // `turn`. `timers` and `workers` must live as long as tasks are added, and `workers` until the
  // last task has run.
  static std::shared_ptr<TickQueue> Make(absl::Duration tick, absl::Duration turn,
                                         TimerQueue* timers, WorkerPool* workers) {
    return std::shared_ptr<TickQueue>(new TickQueue(tick, turn, timers, workers));
  }

  // Runs `task` once at the next tick, or soon after.
  void Add(Task task);

  // Runs the first queued task on the caller's thread. Returns false if the queue is empty.
  bool RunNext();

 private:
  TickQueue(absl::Duration tick, absl::Duration turn, TimerQueue* timers, WorkerPool* workers)
      : tick_(tick), turn_(turn), timers_(timers), workers_(workers) {}

  // Queues the waiting tasks: the tick has come.
  void ReleaseTasks();
  // Has a worker run the queue until it is empty.
  void RunOnWorker();

  const absl::Duration tick_;
  const absl::Duration turn_;
  TimerQueue* const timers_;
  WorkerPool* const workers_;

  Mutex mutex_;
  // Tasks that wait for the next tick. A timer is set exactly while it is not empty.
  std::deque<Task> waiting_ ABSL_GUARDED_BY(mutex_);
  std::deque<Task> released_ ABSL_GUARDED_BY(mutex_);  // released tasks, in order
};

// The queues in which watches wait for their next message: `busy` has the longer tick, for watches
// with many changes per second.
struct TickQueues {
  std::shared_ptr<TickQueue> calm;
  std::shared_ptr<TickQueue> busy;

  // Runs the first queued task of either queue. Returns false if there is none.
  bool RunNext() const { return calm->RunNext() || busy->RunNext(); }
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_TICK_QUEUE_H_
