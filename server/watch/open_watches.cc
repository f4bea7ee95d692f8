#include "server/watch/open_watches.h"

#include "server/watch/watch_call.h"

namespace hypermap::server {

void OpenWatches::Add(WatchCall* call) {
  MutexLock lock(&mutex_);
  calls_.insert(call);
}

void OpenWatches::Remove(WatchCall* call) {
  MutexLock lock(&mutex_);
  calls_.erase(call);
  ending_.erase(call);
}

void OpenWatches::CancelWrites() {
  MutexLock lock(&mutex_);
  for (WatchCall* call : calls_) call->CancelWrite();
}

void OpenWatches::EndUnwanted() {
  MutexLock lock(&mutex_);
  for (WatchCall* call : calls_) {
    if (call->IsWanted()) continue;
    if (ending_.insert(call).second) {
      call->Wake();
    } else {
      call->CancelWrite();
    }
  }
}

}  // namespace hypermap::server
