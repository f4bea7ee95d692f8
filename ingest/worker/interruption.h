// Requests to end a run early.
#ifndef HYPERMAP_INGEST_WORKER_INTERRUPTION_H_
#define HYPERMAP_INGEST_WORKER_INTERRUPTION_H_

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::ingest {

// A flag that is set once and never cleared. Thread safe.
class Interruption {
 public:
  void Request();
  bool requested() const;
  // Waits until `time` or until an interruption is requested. Returns requested().
  bool WaitUntil(SteadyTime time) const;

 private:
  mutable Mutex mutex_;
  mutable CondVar changed_;
  bool requested_ ABSL_GUARDED_BY(mutex_) = false;
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
