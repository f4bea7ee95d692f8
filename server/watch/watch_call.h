// The Watch rpc.
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
#include "server/watch/tick_line.h"
#include "server/watch/watch_group.h"
#include "server/watch/watch_source.h"

namespace hypermap::server {

class WatchCall;

// All that are under way. Thread safe.
class OpenWatches {
 public:
  explicit OpenWatches(int max_watchers) : max_watchers_(max_watchers) {}

  // RESOURCE_EXHAUSTED when there are --max_watchers.
  absl::Status Add(WatchCall* call);
  void Remove(WatchCall* call);
  // Cuts off those whose readers do not take what is written to them.
  void CancelWrites();

 private:
  const int max_watchers_;
  Mutex mutex_;
  std::set<WatchCall*> calls_ ABSL_GUARDED_BY(mutex_);
};

// Writes what a WatchSource makes, one message at a time, the next when gRPC has taken the last;
// when there is nothing new it waits for the map's feed, a time or the end of the call, and holds
// no thread. One that has its messages together waits for a tick of a clock that all share, so that
// they come to what is new at the same time.
//
// At any time one of these has the call, and only who has it touches it: a worker (or the call is
// on its way to one), gRPC with a write, until OnWriteDone goes on or begins to wait, or the gate
// while it waits. Owns itself until OnDone; Finish is called on a worker only.
class WatchCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  // All outlive this; the context lives until OnDone.
  WatchCall(const grpc::CallbackServerContext* context, v1::WatchRequest request,
            const Facilities* facilities, WatchGroups* groups, OpenWatches* watches,
            TimerQueue* timers, const TickLines* lines);

  void OnWriteDone(bool ok) override;
  void OnCancel() override { gate_->Wake(); }
  void OnDone() override;

  // Ends the call without a word when a write is under way.
  void CancelWrite();

 private:
  static constexpr absl::Duration kTurn = absl::Milliseconds(10);
  static constexpr int kBegunForOne = 2;

  // Where those who wake a waiting call knock: they may come late, when there is no call any more.
  //
  // Each wait ends by exactly one turn: by the first who ends it, or by BeginWait itself when
  // somebody would have since the last BeginTurn. So nothing is lost that comes while the call is
  // on a worker or in a write; at worst a knock that was meant for an earlier wait brings a turn in
  // which there is nothing to do. Who begins a wait has set up before all that ends it, and does
  // not touch the call after BeginWait.
  class Gate {
   public:
    explicit Gate(WatchCall* call) : call_(call) {}

    // The call goes on, if it waits, on a worker, or here if it can go on at once; otherwise it
    // does not begin to wait.
    void Wake();
    void WakeHere();
    // From here on the call takes notice of those who wake it.
    void BeginTurn();
    // The call waits, or goes on at once. When this returns another thread may have it.
    void BeginWait();

   private:
    // Whether the call has waited. Then it is the caller's.
    bool EndWait();

    // Lives while waiting_, with who has ended the wait, and in BeginTurn and BeginWait.
    WatchCall* const call_;
    Mutex mutex_;
    bool waiting_ ABSL_GUARDED_BY(mutex_) = false;
    bool woken_ ABSL_GUARDED_BY(mutex_) = false;
  };

  void RunOnWorker();
  void TakeTurn();
  // Anywhere: writes what the group has, or leaves the turn to a worker.
  void TakeShortTurn();
  absl::StatusOr<WatchSource::Step> TakeStep(absl::Time now, grpc::Slice* message);
  void Write(const grpc::Slice& message);
  void WaitForCommits(absl::Time now);
  void WaitForTick();
  void ForgetWait();
  void End(const absl::Status& status);

  const grpc::CallbackServerContext* const context_;
  const v1::WatchRequest request_;
  const Facilities* const facilities_;
  WatchGroups* const groups_;
  OpenWatches* const watches_;
  TimerQueue* const timers_;
  const TickLines* const lines_;
  const RequestLog log_;
  const absl::Status admitted_;
  const std::shared_ptr<Gate> gate_;

  // Of whoever has the call.
  std::unique_ptr<WatchSource> source_;
  grpc::ByteBuffer message_;
  std::optional<ChangeFeed::WaitId> feed_wait_;
  std::optional<TimerQueue::Id> timer_;

  Mutex write_mutex_;
  bool writing_ ABSL_GUARDED_BY(write_mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_CALL_H_
