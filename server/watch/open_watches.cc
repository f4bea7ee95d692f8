#include "server/watch/open_watches.h"

#include <cstddef>

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"
#include "server/watch/watch_call.h"

namespace hypermap::server {

absl::Status OpenWatches::Add(WatchCall* call) {
  MutexLock lock(&mutex_);
  if (calls_.size() >= static_cast<size_t>(max_watchers_)) {
    return admission::TryLater(
        absl::StrCat("there are ", calls_.size(), " watches, --max_watchers is ", max_watchers_));
  }
  calls_.insert(call);
  return absl::OkStatus();
}

void OpenWatches::Remove(WatchCall* call) {
  MutexLock lock(&mutex_);
  calls_.erase(call);
}

void OpenWatches::CancelWrites() {
  MutexLock lock(&mutex_);
  for (WatchCall* call : calls_) call->CancelWrite();
}

}  // namespace hypermap::server
