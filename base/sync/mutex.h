// Locks that both clang's thread safety analysis and ThreadSanitizer understand. std::mutex has no
// annotations, and absl::Mutex is invisible to ThreadSanitizer unless abseil itself is built with
// it, which no distribution does.
#ifndef HYPERMAP_BASE_SYNC_MUTEX_H_
#define HYPERMAP_BASE_SYNC_MUTEX_H_

#include <algorithm>
#include <condition_variable>
#include <mutex>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"

namespace hypermap {

// A std::mutex with annotations. Not recursive.
class ABSL_LOCKABLE Mutex {
 public:
  void lock() ABSL_EXCLUSIVE_LOCK_FUNCTION() { mutex_.lock(); }
  void unlock() ABSL_UNLOCK_FUNCTION() { mutex_.unlock(); }
  // Tells the analysis that the caller holds this, where it can't know; for example in a lambda.
  void AssertHeld() ABSL_ASSERT_EXCLUSIVE_LOCK() {}

 private:
  std::mutex mutex_;
};

// Holds a mutex for its own lifetime.
class ABSL_SCOPED_LOCKABLE MutexLock {
 public:
  explicit MutexLock(Mutex* mutex) ABSL_EXCLUSIVE_LOCK_FUNCTION(mutex) : mutex_(mutex) {
    mutex_->lock();
  }
  ~MutexLock() ABSL_UNLOCK_FUNCTION() { mutex_->unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex* const mutex_;
};

// A condition variable for Mutex.
class CondVar {
 public:
  // Releases the mutex while waiting. May wake up spuriously: call it in a loop.
  void Wait(Mutex* mutex) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) { condition_.wait(*mutex); }
  // As Wait, for at most `timeout`.
  void WaitFor(Mutex* mutex, absl::Duration timeout) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    // The deadline of an infinite timeout would overflow, and the wait return at once.
    condition_.wait_for(*mutex, absl::ToChronoNanoseconds(std::min(timeout, kMaxTimeout)));
  }
  void NotifyOne() { condition_.notify_one(); }
  void NotifyAll() { condition_.notify_all(); }

 private:
  static constexpr absl::Duration kMaxTimeout = absl::Hours(24 * 365);

  std::condition_variable_any condition_;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_MUTEX_H_
