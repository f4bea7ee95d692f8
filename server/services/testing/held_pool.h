// A pool of workers that is busy for as long as a test wants.
#ifndef HYPERMAP_SERVER_SERVICES_TESTING_HELD_POOL_H_
#define HYPERMAP_SERVER_SERVICES_TESTING_HELD_POOL_H_

#include <future>
#include <memory>

#include "server/rpc/worker_pool.h"

namespace hypermap::server {

// Keeps all threads of a pool busy while it exists.
class HeldPool {
 public:
  // Returns when the tasks that the threads had before have ended.
  explicit HeldPool(WorkerPool& pool) {
    for (int i = 0; i < pool.num_threads(); ++i) {
      // The task may end after this is gone.
      auto started = std::make_shared<std::promise<void>>();
      std::future<void> has_started = started->get_future();
      pool.Run([started, released = released_] {
        started->set_value();
        released.wait();
      });
      has_started.wait();
    }
  }
  ~HeldPool() { Release(); }
  HeldPool(const HeldPool&) = delete;
  HeldPool& operator=(const HeldPool&) = delete;

  void Release() {
    if (is_held_) release_.set_value();
    is_held_ = false;
  }

 private:
  bool is_held_ = true;
  std::promise<void> release_;
  const std::shared_future<void> released_ = release_.get_future().share();
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_TESTING_HELD_POOL_H_
