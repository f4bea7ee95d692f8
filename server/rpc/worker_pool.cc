#include "server/rpc/worker_pool.h"

#include <algorithm>
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

void WorkerPool::Run(absl::string_view client, absl::string_view subject, Task task) {
  MutexLock lock(&mutex_);
  std::deque<Queued>& tasks = tasks_[client];
  if (tasks.empty()) turns_.emplace_back(client);
  tasks.push_back({std::string(subject), std::move(task)});
  changed_.NotifyOne();
}

std::deque<std::string>::iterator WorkerPool::FindTurn() {
  return std::find_if(turns_.begin(), turns_.end(), [this](const std::string& client) {
    mutex_.AssertHeld();
    return !busy_subjects_.contains(tasks_.find(client)->second.front().subject);
  });
}

WorkerPool::Queued WorkerPool::Take() {
  MutexLock lock(&mutex_);
  auto turn = FindTurn();
  while (turn == turns_.end() && !(ending_ && turns_.empty())) {
    changed_.Wait(&mutex_);
    turn = FindTurn();
  }
  if (turn == turns_.end()) return {};
  std::string client = std::move(*turn);
  turns_.erase(turn);
  const auto tasks = tasks_.find(client);
  Queued next = std::move(tasks->second.front());
  tasks->second.pop_front();
  if (!next.subject.empty()) busy_subjects_.insert(next.subject);
  if (tasks->second.empty()) {
    tasks_.erase(tasks);
  } else {
    turns_.push_back(std::move(client));
  }
  return next;
}

void WorkerPool::Ended(const std::string& subject) {
  if (subject.empty()) return;
  MutexLock lock(&mutex_);
  busy_subjects_.erase(subject);
  // Several tasks may have waited for the subject, and a thread that waits for the pool's end, too.
  changed_.NotifyAll();
}

void WorkerPool::Work() {
  for (;;) {
    Queued next = Take();
    if (!next.task) return;
    std::move(next.task)();
    // What the task holds is freed before the thread waits for the next one.
    next.task = nullptr;
    Ended(next.subject);
    GiveWay();
  }
}

}  // namespace hypermap::server
