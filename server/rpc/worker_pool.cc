#include "server/rpc/worker_pool.h"

#include <utility>

namespace hypermap::server {

WorkerPool::WorkerPool(int num_threads) {
  threads_.reserve(num_threads);
  for (int i = 0; i < num_threads; ++i) threads_.emplace_back([this] { Work(); });
}

WorkerPool::~WorkerPool() {
  {
    MutexLock lock(&mutex_);
    ending_ = true;
    changed_.NotifyAll();
  }
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::Run(Task task) {
  MutexLock lock(&mutex_);
  tasks_.push_back(std::move(task));
  changed_.NotifyOne();
}

WorkerPool::Task WorkerPool::Take() {
  MutexLock lock(&mutex_);
  while (tasks_.empty() && !ending_) changed_.Wait(&mutex_);
  if (tasks_.empty()) return nullptr;
  Task task = std::move(tasks_.front());
  tasks_.pop_front();
  return task;
}

void WorkerPool::Work() {
  for (Task task = Take(); task; task = Take()) std::move(task)();
}

}  // namespace hypermap::server
