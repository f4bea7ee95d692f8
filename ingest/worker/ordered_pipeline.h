// A pipeline that processes items on several threads and returns the results in the items' order.
#ifndef HYPERMAP_INGEST_WORKER_ORDERED_PIPELINE_H_
#define HYPERMAP_INGEST_WORKER_ORDERED_PIPELINE_H_

#include <functional>
#include <map>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"

namespace hypermap::ingest {

// At most `window` items are being processed or have results that were not taken, so that memory is
// bounded if the caller of Next() is slow. Next() may be called from one thread only.
template <typename Result>
class OrderedPipeline {
 public:
  // Calls `work(i)` once for each i < count, in ascending order, on `threads` threads.
  OrderedPipeline(size_t count, int threads, size_t window, std::function<Result(size_t)> work)
      : count_(count), window_(window), work_(std::move(work)) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Run(); });
  }
  // Begins no further calls of `work` and waits for those that are running.
  ~OrderedPipeline() {
    {
      const MutexLock lock(&mutex_);
      stopped_ = true;
    }
    may_begin_.NotifyAll();
    for (std::thread& thread : threads_) thread.join();
  }
  OrderedPipeline(const OrderedPipeline&) = delete;
  OrderedPipeline& operator=(const OrderedPipeline&) = delete;

  // Waits for the result of the next item and returns it; nullopt after the last.
  std::optional<Result> Next() {
    const MutexLock lock(&mutex_);
    if (taken_ == count_) return std::nullopt;
    while (done_.count(taken_) == 0) is_done_.Wait(&mutex_);
    auto node = done_.extract(taken_);
    ++taken_;
    may_begin_.NotifyAll();
    return std::move(node.mapped());
  }

 private:
  bool MayBegin() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return stopped_ || begun_ == count_ || begun_ < taken_ + window_;
  }

  void Run() {
    while (true) {
      size_t item;
      {
        const MutexLock lock(&mutex_);
        while (!MayBegin()) may_begin_.Wait(&mutex_);
        if (stopped_ || begun_ == count_) return;
        item = begun_++;
      }
      Result result = work_(item);
      {
        const MutexLock lock(&mutex_);
        done_.emplace(item, std::move(result));
      }
      is_done_.NotifyOne();
    }
  }

  const size_t count_;
  const size_t window_;
  const std::function<Result(size_t)> work_;
  Mutex mutex_;
  CondVar may_begin_;
  CondVar is_done_;
  size_t begun_ ABSL_GUARDED_BY(mutex_) = 0;
  size_t taken_ ABSL_GUARDED_BY(mutex_) = 0;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<size_t, Result> done_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_ORDERED_PIPELINE_H_
