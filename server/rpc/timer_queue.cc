#include "server/rpc/timer_queue.h"

#include "base/sync/thread_name.h"

namespace hypermap::server {

TimerQueue::TimerQueue() : thread_([this] { Work(); }) {}

TimerQueue::~TimerQueue() {
  {
    MutexLock lock(&mutex_);
    ending_ = true;
    changed_.NotifyOne();
  }
  thread_.join();
}

TimerQueue::Id TimerQueue::RunAfter(absl::Duration delay, Task task) {
  const Instant due = std::chrono::steady_clock::now() + absl::ToChronoNanoseconds(delay);
  MutexLock lock(&mutex_);
  const Id id = next_id_++;
  const auto it = tasks_.emplace(std::make_pair(due, id), std::move(task)).first;
  due_.emplace(id, due);
  if (it == tasks_.begin()) changed_.NotifyOne();
  return id;
}

void TimerQueue::Cancel(Id id) {
  Task dropped;  // Destroyed after the lock is released, because it may own objects that use this.
  MutexLock lock(&mutex_);
  const auto due = due_.find(id);
  if (due == due_.end()) return;
  const auto task = tasks_.find({due->second, id});
  dropped = std::move(task->second);
  tasks_.erase(task);
  due_.erase(due);
}

TimerQueue::Task TimerQueue::Take() {
  MutexLock lock(&mutex_);
  while (!ending_) {
    if (tasks_.empty()) {
      changed_.Wait(&mutex_);
      continue;
    }
    const auto first = tasks_.begin();
    const auto wait = first->first.first - std::chrono::steady_clock::now();
    if (wait > Instant::duration::zero()) {
      changed_.WaitFor(&mutex_, absl::FromChrono(wait));
      continue;
    }
    Task task = std::move(first->second);
    due_.erase(first->first.second);
    tasks_.erase(first);
    return task;
  }
  return nullptr;
}

void TimerQueue::Work() {
  NameThisThread("hm-timers");
  // Each task and the objects that it holds are freed before the thread waits for the next one.
  while (Task task = Take()) std::move(task)();
}

}  // namespace hypermap::server
