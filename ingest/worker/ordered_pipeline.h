// Works items in several threads and hands the results out in the order of the items.
#ifndef HYPERMAP_INGEST_WORKER_ORDERED_PIPELINE_H_
#define HYPERMAP_INGEST_WORKER_ORDERED_PIPELINE_H_

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace hypermap::ingest {

// At most `window` results are in work or waiting, so that a slow taker bounds the memory. Next is
// for one thread.
template <typename Result>
class OrderedPipeline {
 public:
  // `work(i)` is called once for each i < count, from any of `threads` threads.
  OrderedPipeline(size_t count, int threads, size_t window, std::function<Result(size_t)> work)
      : count_(count), window_(window), work_(std::move(work)) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Run(); });
  }
  // Waits for the calls of `work` that have begun; no more are made.
  ~OrderedPipeline() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    may_begin_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  OrderedPipeline(const OrderedPipeline&) = delete;
  OrderedPipeline& operator=(const OrderedPipeline&) = delete;

  // The result of the next item; nullopt after the last.
  std::optional<Result> Next() {
    std::unique_lock<std::mutex> lock(mutex_);
    if (taken_ == count_) return std::nullopt;
    is_done_.wait(lock, [this] { return done_.count(taken_) > 0; });
    auto node = done_.extract(taken_);
    ++taken_;
    may_begin_.notify_all();
    return std::move(node.mapped());
  }

 private:
  bool MayBegin() const { return stopped_ || begun_ == count_ || begun_ < taken_ + window_; }

  void Run() {
    while (true) {
      size_t item;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        may_begin_.wait(lock, [this] { return MayBegin(); });
        if (stopped_ || begun_ == count_) return;
        item = begun_++;
      }
      Result result = work_(item);
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        done_.emplace(item, std::move(result));
      }
      is_done_.notify_one();
    }
  }

  const size_t count_;
  const size_t window_;
  const std::function<Result(size_t)> work_;
  // Guards what follows, but for the threads. Not absl's, which ThreadSanitizer can't see unless
  // abseil is built with it.
  std::mutex mutex_;
  std::condition_variable may_begin_;
  std::condition_variable is_done_;
  size_t begun_ = 0;
  size_t taken_ = 0;
  bool stopped_ = false;
  std::map<size_t, Result> done_;
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_ORDERED_PIPELINE_H_
