#include "server/rpc/worker_pool.h"

#include <utility>

#include "base/cancellation/give_way.h"
#include "server/rpc/scheduling.h"

namespace hypermap::server {

WorkerPool::WorkerPool(int num_threads, int niceness) {
  threads_.reserve(num_threads);
  for (int i = 0; i < num_threads; ++i) {
    threads_.emplace_back([this, niceness] {
      if (niceness > 0) LowerPriority(niceness);
      Work();
    });
  }
}

WorkerPool::~WorkerPool() {
  {
    MutexLock lock(&mutex_);
    ending_ = true;
    changed_.NotifyAll();
  }
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::Run(absl::string_view client, Task task) {
  MutexLock lock(&mutex_);
  std::deque<Task>& tasks = tasks_[client];
  if (tasks.empty()) turns_.emplace_back(client);
  tasks.push_back(std::move(task));
  changed_.NotifyOne();
}

WorkerPool::Task WorkerPool::Take() {
  MutexLock lock(&mutex_);
  while (turns_.empty() && !ending_) changed_.Wait(&mutex_);
  if (turns_.empty()) return nullptr;
  std::string client = std::move(turns_.front());
  turns_.pop_front();
  const auto tasks = tasks_.find(client);
  Task task = std::move(tasks->second.front());
  tasks->second.pop_front();
  if (tasks->second.empty()) {
    tasks_.erase(tasks);
  } else {
    turns_.push_back(std::move(client));
  }
  return task;
}

void WorkerPool::Work() {
  // What a task holds is freed before the thread waits for the next one.
  while (Task task = Take()) {
    std::move(task)();
    GiveWay();
  }
}

}  // namespace hypermap::server
