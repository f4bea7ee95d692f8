// The wish that a run should end.
#ifndef HYPERMAP_INGEST_WORKER_INTERRUPTION_H_
#define HYPERMAP_INGEST_WORKER_INTERRUPTION_H_

#include <condition_variable>
#include <mutex>

#include "absl/time/time.h"

namespace hypermap::ingest {

// Thread safe.
class Interruption {
 public:
  void Request();
  bool requested() const;
  // Waits until `time`, or until it is requested. Whether it is.
  bool WaitUntil(absl::Time time) const;

 private:
  // Not absl's, which ThreadSanitizer can't see unless abseil is built with it.
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool requested_ = false;  // guarded by the mutex
};

// Turns the first SIGINT or SIGTERM into a request; the second ends the program. Make it before any
// other thread: signals are kept from those that are made later. At most one at a time.
class SignalWatch {
 public:
  explicit SignalWatch(Interruption& interruption);
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_INTERRUPTION_H_
