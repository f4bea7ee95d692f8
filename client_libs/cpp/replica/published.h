// A shared value that is replaced now and then, and read much more often than that.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_PUBLISHED_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_PUBLISHED_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

namespace hypermap::client {

// Readers never wait, and pay two counts instead of a lock and a reference; who replaces the value
// waits until nobody reads the old one any more. This is the read-copy update of two phases:
// readers count themselves in the current phase, a writer sets the new value, turns the phase, and
// lets the old value go when the old phase is empty. Thread safe.
template <typename T>
class Published {
 public:
  // Keeps the value that was the newest when it was made. For short work: Set waits for it. A
  // thread that holds one must not call Set.
  class Reading {
   public:
    explicit Reading(const Published& published) : readers_(published.Enter()) {
      value_ = published.newest_.load();
    }
    ~Reading() { readers_.fetch_sub(1, std::memory_order_release); }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;

    const T* get() const { return value_; }
    const T* operator->() const { return value_; }
    const T& operator*() const { return *value_; }

   private:
    std::atomic<int64_t>& readers_;
    const T* value_;
  };

  // Null before the first Set.
  Reading Read() const { return Reading(*this); }

  void Set(std::unique_ptr<const T> value) {
    const std::lock_guard<std::mutex> lock(writer_);
    newest_.store(value.get());
    const unsigned phase = phase_.load();
    phase_.store(1 - phase);
    // Who comes now counts in the other phase and finds the new value.
    while (readers_[phase].load() != 0) std::this_thread::yield();
    kept_ = std::move(value);
  }

 private:
  std::atomic<int64_t>& Enter() const {
    for (;;) {
      const unsigned phase = phase_.load();
      readers_[phase].fetch_add(1);
      // Else a writer may have found nobody there before this was counted.
      if (phase_.load() == phase) return readers_[phase];
      readers_[phase].fetch_sub(1);
    }
  }

  std::atomic<const T*> newest_{nullptr};
  std::atomic<unsigned> phase_{0};
  mutable std::atomic<int64_t> readers_[2] = {0, 0};

  std::mutex writer_;
  std::unique_ptr<const T> kept_;  // what newest_ points to
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_PUBLISHED_H_
