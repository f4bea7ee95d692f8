// A queue of tasks that are released together at the next tick of a clock.
#ifndef HYPERMAP_SERVER_WATCH_TICK_LINE_H_
#define HYPERMAP_SERVER_WATCH_TICK_LINE_H_

#include <deque>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "server/rpc/timer_queue.h"
#include "server/rpc/worker_pool.h"

namespace hypermap::server {

// Holds short tasks until the next tick of a clock that all lines with the same period share, then
// queues them. One worker runs the queue task by task. Threads that are awake anyway may help with
// RunNext, because waking a thread costs as much as the write that a task starts. No thread waits
// for another. Thread safe.
class TickLine : public std::enable_shared_from_this<TickLine> {
 public:
  using Task = absl::AnyInvocable<void() &&>;

  // `timers` and `workers` must live as long as tasks are added, and `workers` until the last task
  // has run.
  static std::shared_ptr<TickLine> Make(absl::Duration tick, TimerQueue* timers,
                                        WorkerPool* workers) {
    return std::shared_ptr<TickLine>(new TickLine(tick, timers, workers));
  }

  // Runs `task` once at the next tick, or soon after.
  void Add(Task task);

  // Runs the first queued task on the caller's thread. Returns false if the queue is empty.
  bool RunNext();

 private:
  TickLine(absl::Duration tick, TimerQueue* timers, WorkerPool* workers)
      : tick_(tick), timers_(timers), workers_(workers) {}

  // Queues the waiting tasks: the tick has come.
  void LineUp();
  // Has a worker run the queue until it is empty.
  void RunOnWorker();

  const absl::Duration tick_;
  TimerQueue* const timers_;
  WorkerPool* const workers_;

  Mutex mutex_;
  // Tasks that wait for the next tick. A timer is set exactly while it is not empty.
  std::deque<Task> waiting_ ABSL_GUARDED_BY(mutex_);
  std::deque<Task> line_ ABSL_GUARDED_BY(mutex_);  // released tasks, in order
};

// The lines in which watches wait for their next message: `busy` has the longer tick, for watches
// with many changes per second.
struct TickLines {
  std::shared_ptr<TickLine> calm;
  std::shared_ptr<TickLine> busy;

  // Runs the first queued task of either line. Returns false if there is none.
  bool RunNext() const { return calm->RunNext() || busy->RunNext(); }
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_TICK_LINE_H_
