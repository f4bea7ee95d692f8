// Things to do a little later.
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

// Runs short tasks on a thread of its own, by when they are due. Setting the clock does not disturb
// it. Thread safe.
class TimerQueue {
 public:
  using Task = absl::AnyInvocable<void() &&>;
  using Id = int64_t;

  TimerQueue();
  // Drops what is not due yet.
  ~TimerQueue();
  TimerQueue(const TimerQueue&) = delete;
  TimerQueue& operator=(const TimerQueue&) = delete;

  // Runs `task` when `delay` has passed.
  Id RunAfter(absl::Duration delay, Task task);
  // Drops a task that is not run yet; it may be under way.
  void Cancel(Id id);

 private:
  using Instant = std::chrono::steady_clock::time_point;

  void Work();
  // Waits for a task that is due; null when the queue ends.
  Task Take();

  Mutex mutex_;
  CondVar changed_;
  std::map<std::pair<Instant, Id>, Task> tasks_ ABSL_GUARDED_BY(mutex_);
  std::map<Id, Instant> due_ ABSL_GUARDED_BY(mutex_);
  Id next_id_ ABSL_GUARDED_BY(mutex_) = 1;
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_TIMER_QUEUE_H_
