#include "server/watch/wake_handle.h"

#include <utility>

namespace hypermap::server {

bool WakeHandle::EndWait() {
  MutexLock lock(&mutex_);
  if (std::exchange(waiting_, false)) return true;
  woken_ = true;
  return false;
}

void WakeHandle::Wake() {
  if (EndWait()) run_on_worker_();
}

void WakeHandle::WakeHere() {
  if (EndWait()) run_here_();
}

void WakeHandle::BeginTurn() {
  MutexLock lock(&mutex_);
  woken_ = false;
}

void WakeHandle::BeginWait() {
  MutexLock lock(&mutex_);
  if (woken_) {
    // On a worker, because the caller may be a gRPC thread, which must not be held up.
    run_on_worker_();
  } else {
    waiting_ = true;
  }
}

}  // namespace hypermap::server
