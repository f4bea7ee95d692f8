// One Watch rpc, from its start to its end.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_CALL_H_
#define HYPERMAP_SERVER_WATCH_WATCH_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/slice.h>

#include <memory>
#include <optional>
#include <set>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/watch_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_log.h"
#include "server/rpc/timer_queue.h"
#include "server/watch/tick_queue.h"
#include "server/watch/watch_group.h"
#include "server/watch/watch_source.h"

namespace hypermap::server {

class WatchCall;

// The registry of all Watch rpcs that are under way. Thread safe.
class OpenWatches {
 public:
  explicit OpenWatches(int max_watchers) : max_watchers_(max_watchers) {}

  // RESOURCE_EXHAUSTED if there are --max_watchers already; then the call is not added.
  absl::Status Add(WatchCall* call);
  // Does nothing for a call that was not added.
  void Remove(WatchCall* call);
  // Cancels the calls with a write under way, whose readers may never take it.
  void CancelWrites();

 private:
  const int max_watchers_;
  Mutex mutex_;
  std::set<WatchCall*> calls_ ABSL_GUARDED_BY(mutex_);
};

// Writes the messages of a WatchSource, one at a time: the next when gRPC has taken the last. When
// there is nothing new, the call waits for the map's feed, a timer or the end of the rpc, and holds
// no thread. A call with `coalesce` that has reached the newest revision waits for a tick of a
// clock that all calls share, so that the watches of a group reach the same commit at the same time
// and write the same bytes.
//
// The call has one owner at any time, and only the owner may touch it: a worker (or the worker
// pool's queue); or gRPC during a write, until OnWriteDone goes on or begins to wait; or the wake
// handle while the call waits. The call deletes itself in OnDone. Finish is called on a worker
// only.
class WatchCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  // All pointers must outlive this, except the context, which lives until OnDone.
  WatchCall(const grpc::CallbackServerContext* context, v1::WatchRequest request,
            const Facilities* facilities, WatchGroups* groups, OpenWatches* watches,
            TimerQueue* timers, const TickQueues* tick_queues);

  void OnWriteDone(bool ok) override;
  void OnCancel() override { wake_handle_->Wake(); }
  void OnDone() override;

  // Cancels the rpc if a write is under way: the client gets CANCELLED and no revision to resume
  // from.
  void CancelWrite();

 private:
  // Longest time on a worker before the call queues again behind the other requests.
  static constexpr absl::Duration kTurn = absl::Milliseconds(10);
  // Number of other calls whose writes are started at the end of a write. With more than one, the
  // number of writes under way grows while the queue of a tick lasts.
  static constexpr int kBegunForOne = 2;

  // Wakes a waiting call. The callbacks of feed, timer and tick share the handle, because they may
  // come late, when the call is gone.
  //
  // Each wait ends with exactly one turn. It is started by the first callback, or by BeginWait
  // itself if a callback came since the last BeginTurn. So no callback is lost that comes while the
  // call is on a worker or in a write; at worst, a late callback of an earlier wait causes a turn
  // with nothing to do. Everything that can end a wait is set up before BeginWait, and the caller
  // of BeginWait does not touch the call afterwards.
  class WakeHandle {
   public:
    explicit WakeHandle(WatchCall* call) : call_(call) {}

    // If the call waits, gives it a turn: Wake on a worker, WakeHere a short one on this thread. If
    // it does not wait, keeps it from beginning to.
    void Wake();
    void WakeHere();
    // Forgets the callbacks so far, which this turn takes account of.
    void BeginTurn();
    // Makes the call wait, or run on a worker if a callback came since BeginTurn. When this
    // returns, another thread may own the call, and it may be gone.
    void BeginWait();

   private:
    // Returns whether the call was waiting. If so, the caller owns it now.
    bool EndWait();

    // Valid while waiting_, for the thread that has ended the wait, and in BeginTurn and BeginWait.
    WatchCall* const call_;
    Mutex mutex_;
    bool waiting_ ABSL_GUARDED_BY(mutex_) = false;
    bool woken_ ABSL_GUARDED_BY(mutex_) = false;
  };

  void RunOnWorker();
  // Takes steps until there is a message to write, or nothing to do, or kTurn has passed.
  void TakeTurn();
  // Writes the group's next message if it has one; otherwise leaves the turn to a worker. Short
  // enough for gRPC's threads.
  void TakeShortTurn();
  absl::StatusOr<WatchSource::Step> TakeStep(absl::Time now, grpc::Slice* message);
  void Write(const grpc::Slice& message);
  void WaitForCommits(absl::Time now);
  void WaitForTick();
  // Removes the callbacks that the last wait left in the feed and the timers.
  void ForgetWait();
  void End(const absl::Status& status);

  const grpc::CallbackServerContext* const context_;
  const v1::WatchRequest request_;
  const Facilities* const facilities_;
  WatchGroups* const groups_;
  OpenWatches* const watches_;
  TimerQueue* const timers_;
  const TickQueues* const tick_queues_;
  const RequestLog log_;
  const absl::Status admitted_;  // by watches_
  const std::shared_ptr<WakeHandle> wake_handle_;

  // Used by the owner of the call only.
  std::unique_ptr<WatchSource> source_;  // null until the first turn
  grpc::ByteBuffer message_;
  std::optional<ChangeFeed::WaitId> feed_wait_;
  std::optional<TimerQueue::Id> timer_;

  Mutex write_mutex_;
  bool writing_ ABSL_GUARDED_BY(write_mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_CALL_H_
