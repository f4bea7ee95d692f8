// The messages of a stream that goes on until its caller ends it.
#ifndef HYPERMAP_SERVER_WATCH_LIVE_SOURCE_H_
#define HYPERMAP_SERVER_WATCH_LIVE_SOURCE_H_

#include <grpcpp/support/slice.h>

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/steady_time.h"
#include "server/watch/wake_handle.h"

namespace hypermap::server {

// Makes the messages of a WatchCall one by one, and lets it wait for more. Memory does not grow
// with the slowness of a reader. Not thread safe; may be handed from thread to thread.
class LiveSource {
 public:
  enum class Step { kMessage, kNothingYet, kNothingNew };

  virtual ~LiveSource() = default;

  // Makes the bytes of the next message, or does a bounded amount of work towards it. kNothingNew
  // means that there is nothing to do until what BeginWait waits for, or until idle_for(now) has
  // passed. An error ends the rpc.
  virtual absl::StatusOr<Step> Next(SteadyTime now, grpc::Slice* message) = 0;
  // Makes the next message if that takes little time on any thread, and returns whether it did.
  virtual bool TakeShared(SteadyTime now, grpc::Slice* message) = 0;

  // Returns whether the next message should wait for a tick, so that it contains more.
  virtual bool gathers() const = 0;
  // Returns whether there is so much to tell that it should wait for the longer tick.
  virtual bool is_busy() const = 0;
  // Time until the next message is due if nothing happens; not negative.
  virtual absl::Duration idle_for(SteadyTime now) const = 0;

  // Wakes the call once there is something new, or the map is closing.
  virtual void BeginWait(const std::shared_ptr<WakeHandle>& wake_handle) = 0;
  // Forgets the callbacks that the last wait left behind, if any.
  virtual void EndWait() = 0;

  // Number of items in all messages so far, for the log.
  virtual int64_t items() const = 0;
  // Bytes of memory that the source takes at most for its filter, whatever the map: an estimate.
  virtual int64_t memory() const = 0;
  // Returns whether the source holds content that was read but not sent, and charged to the
  // MemoryMeter of the Next that read it.
  virtual bool holds_commits() const = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_LIVE_SOURCE_H_
