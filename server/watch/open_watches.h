// The watches of a server that are under way.
#ifndef HYPERMAP_SERVER_WATCH_OPEN_WATCHES_H_
#define HYPERMAP_SERVER_WATCH_OPEN_WATCHES_H_

#include <set>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

class WatchCall;

// The registry of all Watch, Replicate and WatchRobots rpcs that are under way. Thread safe.
class OpenWatches {
 public:
  OpenWatches() = default;
  // gRPC's shutdown has waited for the last Remove; the lock lets ThreadSanitizer see that.
  ~OpenWatches() { const MutexLock lock(&mutex_); }

  void Add(WatchCall* call);
  // Does nothing for a call that was not added.
  void Remove(WatchCall* call);
  // Cancels the calls with a write under way, whose readers may never take it.
  void CancelWrites();
  // Wakes the calls that are not wanted any more, so that they end with the reason. One that has
  // not ended when this is called again, because its reader takes nothing, is cancelled.
  void EndUnwanted();

 private:
  Mutex mutex_;
  std::set<WatchCall*> calls_ ABSL_GUARDED_BY(mutex_);
  std::set<WatchCall*> ending_ ABSL_GUARDED_BY(mutex_);  // woken by EndUnwanted
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_OPEN_WATCHES_H_
