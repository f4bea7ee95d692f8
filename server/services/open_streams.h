// The streams of calls that clients end, so that the server ends them when it stops.
#ifndef HYPERMAP_SERVER_SERVICES_OPEN_STREAMS_H_
#define HYPERMAP_SERVER_SERVICES_OPEN_STREAMS_H_

#include <set>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// The error with which streams end when the server stops.
inline absl::Status ServerStops() { return absl::UnavailableError("the server is stopping"); }

class EndableStream {
 public:
  // Ends the stream with ServerStops() when what was read of it is answered. Called at most once,
  // by any thread, and not after OpenStreams::Remove.
  virtual void EndSoon() = 0;

 protected:
  ~EndableStream() = default;
};

// The streams of one kind of call that are under way. Thread safe.
class OpenStreams {
 public:
  OpenStreams() = default;
  // gRPC's shutdown has waited for the last Remove; the lock lets ThreadSanitizer see that.
  ~OpenStreams() { const MutexLock lock(&mutex_); }

  // Returns false, without adding the stream, if the server is stopping.
  bool Add(EndableStream* stream) {
    const MutexLock lock(&mutex_);
    if (stopping_) return false;
    streams_.insert(stream);
    return true;
  }
  // Must be called in OnDone. Does nothing for a stream that was not added.
  void Remove(EndableStream* stream) {
    const MutexLock lock(&mutex_);
    streams_.erase(stream);
  }
  // Ends all streams, and refuses new ones.
  void Stop() {
    // While the lock is held no stream is deleted, because OnDone waits for it in Remove. This
    // can't deadlock, because gRPC calls OnDone on another thread than the one that calls Finish.
    const MutexLock lock(&mutex_);
    stopping_ = true;
    for (EndableStream* stream : streams_) stream->EndSoon();
  }

 private:
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<EndableStream*> streams_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_OPEN_STREAMS_H_
