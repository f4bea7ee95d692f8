// A shared value that is read much more often than it is replaced.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_PUBLISHED_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_PUBLISHED_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"

namespace hypermap::client {

// Two-phase read-copy update. Readers never wait and pay two atomic additions instead of a lock
// and a reference count. A reader counts itself in the current phase; a writer stores the new
// value, switches the phase, and destroys the old value when the count of the old phase is zero.
// Thread safe.
template <typename T>
class Published {
 public:
  // Keeps the value alive that was the newest at its construction. Meant for short work, since Set
  // waits for it. A thread that holds a Reading must not call Set.
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

  // Points to null before the first Set.
  Reading Read() const { return Reading(*this); }

  void Set(std::unique_ptr<const T> value) {
    const MutexLock lock(&writer_);
    newest_.store(value.get());
    const unsigned phase = phase_.load();
    phase_.store(1 - phase);
    // Readers that enter from now on count in the other phase and see the new value.
    while (readers_[phase].load() != 0) std::this_thread::yield();
    kept_ = std::move(value);
  }

 private:
  std::atomic<int64_t>& Enter() const {
    for (;;) {
      const unsigned phase = phase_.load();
      readers_[phase].fetch_add(1);
      // If the phase was switched meanwhile, a writer may have seen a zero count before this reader
      // was counted, and may destroy the value.
      if (phase_.load() == phase) return readers_[phase];
      readers_[phase].fetch_sub(1);
    }
  }

  std::atomic<const T*> newest_{nullptr};
  std::atomic<unsigned> phase_{0};
  mutable std::atomic<int64_t> readers_[2] = {0, 0};

  Mutex writer_;
  std::unique_ptr<const T> kept_ ABSL_GUARDED_BY(writer_);  // what newest_ points to
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_PUBLISHED_H_
