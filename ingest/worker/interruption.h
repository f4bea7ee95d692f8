// Requests to end a run early.
#ifndef HYPERMAP_INGEST_WORKER_INTERRUPTION_H_
#define HYPERMAP_INGEST_WORKER_INTERRUPTION_H_

#include <condition_variable>
#include <mutex>

#include "absl/time/time.h"

namespace hypermap::ingest {

// A flag that is set once and never cleared. Thread safe.
class Interruption {
 public:
  void Request();
  bool requested() const;
  // Waits until `time` or until an interruption is requested. Returns requested().
  bool WaitUntil(absl::Time time) const;

 private:
  // Not absl::Mutex, which ThreadSanitizer can't see unless abseil is built with it.
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool requested_ = false;  // Guarded by mutex_.
};

// Turns the first SIGINT or SIGTERM into a request; the second ends the program. REQUIRES: no other
// thread exists yet, because threads inherit the blocked signals from this one. At most one object
// of this class in a program.
class SignalWatch {
 public:
  explicit SignalWatch(Interruption& interruption);
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_INTERRUPTION_H_
