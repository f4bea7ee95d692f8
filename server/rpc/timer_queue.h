// Timers: tasks that run after a delay.
#ifndef HYPERMAP_SERVER_RPC_TIMER_QUEUE_H_
#define HYPERMAP_SERVER_RPC_TIMER_QUEUE_H_

#include <chrono>
#include <cstdint>
#include <map>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Runs short tasks on a thread of its own, in the order in which they are due. Uses the steady
// clock, so that setting the system's clock has no effect. Thread safe.
class TimerQueue {
 public:
  using Task = absl::AnyInvocable<void() &&>;
  using Id = int64_t;

  TimerQueue();
  // Drops the tasks that have not run, and waits for the one under way.
  ~TimerQueue();
  TimerQueue(const TimerQueue&) = delete;
  TimerQueue& operator=(const TimerQueue&) = delete;

  // Runs `task` when `delay` has passed.
  Id RunAfter(absl::Duration delay, Task task);
  // Drops a task that has not run yet. It may already be running on the queue's thread.
  void Cancel(Id id);

 private:
  using Instant = std::chrono::steady_clock::time_point;

  void Work();
  // Waits for a task that is due; returns null when the queue ends.
  Task Take();

  Mutex mutex_;
  CondVar changed_;
  std::map<std::pair<Instant, Id>, Task> tasks_ ABSL_GUARDED_BY(mutex_);
  std::map<Id, Instant> due_ ABSL_GUARDED_BY(mutex_);  // finds a task's key in tasks_ for Cancel
  Id next_id_ ABSL_GUARDED_BY(mutex_) = 1;
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_TIMER_QUEUE_H_
