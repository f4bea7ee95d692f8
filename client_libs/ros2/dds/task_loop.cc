#include "client_libs/ros2/dds/task_loop.h"

#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::ros2 {

absl::Status TaskLoop::Start() {
  HYPERMAP_ASSIGN_OR_RETURN(running_,
                            ThreadExecutor().Start("hm-ros2-calls", [this] { return Step(); }));
  return absl::OkStatus();
}

TaskLoop::~TaskLoop() {
  if (running_ == nullptr) return;
  {
    const MutexLock lock(&mutex_);
    ends_ = true;
  }
  running_->Wake();
  running_->Join();
}

void TaskLoop::Add(SteadyTime due, Task task) {
  {
    const MutexLock lock(&mutex_);
    tasks_.emplace(due, std::move(task));
  }
  running_->Wake();
}

std::optional<absl::Duration> TaskLoop::Step() {
  Task task;
  {
    const MutexLock lock(&mutex_);
    if (ends_) return std::nullopt;
    if (tasks_.empty()) return absl::InfiniteDuration();
    const auto first = tasks_.begin();
    const absl::Duration left = first->first - Now();
    if (left > absl::ZeroDuration()) return left;
    task = std::move(first->second);
    tasks_.erase(first);
  }
  task();
  return absl::ZeroDuration();
}

}  // namespace hypermap::ros2
