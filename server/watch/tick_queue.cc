#include "server/watch/tick_queue.h"

#include <utility>

#include "absl/time/clock.h"
#include "base/sync/deadline.h"

namespace hypermap::server {

void TickQueue::Add(Task task) {
  {
    MutexLock lock(&mutex_);
    waiting_.push_back(std::move(task));
    if (waiting_.size() > 1) return;
  }
  // Ticks are multiples of the period since the epoch, not a delay from now, so that tasks that are
  // added at different times are released together.
  const absl::Duration since_tick = (absl::Now() - absl::UnixEpoch()) % tick_;
  timers_->RunAfter(tick_ - since_tick, [self = shared_from_this()] { self->ReleaseTasks(); });
}

bool TickQueue::RunNext() {
  Task task;
  {
    MutexLock lock(&mutex_);
    if (released_.empty()) return false;
    task = std::move(released_.front());
    released_.pop_front();
  }
  std::move(task)();
  return true;
}

void TickQueue::ReleaseTasks() {
  {
    MutexLock lock(&mutex_);
    for (Task& task : waiting_) released_.push_back(std::move(task));
    waiting_.clear();
  }
  RunOnWorker();
}

void TickQueue::RunOnWorker() {
  workers_->Run([self = shared_from_this()] {
    const Deadline end_of_turn(self->turn_);
    while (self->RunNext()) {
      if (end_of_turn.has_passed()) return self->RunOnWorker();
    }
  });
}

}  // namespace hypermap::server
