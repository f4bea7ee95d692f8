// Tasks that are done together, a little later.
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

// Short tasks that wait for the next tick of a clock, all for the same. When it comes they stand in
// a line, from which a worker takes one after the other; others may help, on whose threads the
// tasks cost less. Nobody waits for who helps. Thread safe.
class TickLine : public std::enable_shared_from_this<TickLine> {
 public:
  using Task = absl::AnyInvocable<void() &&>;

  // Both live as long as tasks are added; the workers until the last is done.
  static std::shared_ptr<TickLine> Make(absl::Duration tick, TimerQueue* timers,
                                        WorkerPool* workers) {
    return std::shared_ptr<TickLine>(new TickLine(tick, timers, workers));
  }

  // Runs `task` once at the next tick, or soon after.
  void Add(Task task);

  // Runs the first task in the line, here; false when there is none.
  bool RunNext();

 private:
  TickLine(absl::Duration tick, TimerQueue* timers, WorkerPool* workers)
      : tick_(tick), timers_(timers), workers_(workers) {}

  void LineUp();
  void RunOnWorker();

  const absl::Duration tick_;
  TimerQueue* const timers_;
  WorkerPool* const workers_;

  Mutex mutex_;
  // Of a tick that is to come; there is a timer for it unless it is empty.
  std::deque<Task> waiting_ ABSL_GUARDED_BY(mutex_);
  std::deque<Task> line_ ABSL_GUARDED_BY(mutex_);
};

// Where messages gather, by how much there is to tell.
struct TickLines {
  std::shared_ptr<TickLine> calm;
  std::shared_ptr<TickLine> busy;

  // Runs the first task of either; false when there is none.
  bool RunNext() const { return calm->RunNext() || busy->RunNext(); }
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_TICK_LINE_H_
