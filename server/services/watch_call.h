// The Watch rpc.
#ifndef HYPERMAP_SERVER_SERVICES_WATCH_CALL_H_
#define HYPERMAP_SERVER_SERVICES_WATCH_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <optional>
#include <set>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "hypermap/v1/watch_service.pb.h"
#include "server/services/facilities.h"
#include "server/services/request_log.h"
#include "server/services/timer_queue.h"
#include "server/services/watch_source.h"
#include "server/session/mutex.h"

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
// no thread. At any time the call is in one of these places: on a worker (or on its way there), in
// a write, or waiting. Owns itself until OnDone; Finish is called on a worker only.
class WatchCall final : public grpc::ServerWriteReactor<v1::WatchResponse> {
 public:
  // All outlive this; the context and the request live until OnDone.
  WatchCall(const grpc::CallbackServerContext* context, const v1::WatchRequest* request,
            const Facilities* facilities, OpenWatches* watches, TimerQueue* timers);

  void OnWriteDone(bool ok) override;
  void OnCancel() override { gate_->Wake(); }
  void OnDone() override;

  // Ends the call without a word when a write is under way.
  void CancelWrite();

 private:
  static constexpr absl::Duration kTurn = absl::Milliseconds(10);

  // Where those who wake a waiting call knock: they may come late, when there is no call any more.
  class Gate {
   public:
    Gate(WatchCall* call, WorkerPool* workers) : call_(call), workers_(workers) {}

    // The call goes on if it waits, or does not begin to.
    void Wake();
    // From here on the call takes notice of those who wake it.
    void BeginTurn();
    // Whether the call waits now. If so, another thread may have it already.
    bool BeginWait();

   private:
    // Lives while waiting_.
    WatchCall* const call_;
    WorkerPool* const workers_;
    Mutex mutex_;
    bool waiting_ ABSL_GUARDED_BY(mutex_) = false;
    bool woken_ ABSL_GUARDED_BY(mutex_) = false;
  };

  void TakeTurn();
  absl::StatusOr<WatchSource::Step> TakeStep(absl::Time now);
  void Wait(absl::Time now);
  void ForgetWait();
  void End(const absl::Status& status);

  const grpc::CallbackServerContext* const context_;
  const v1::WatchRequest* const request_;
  const Facilities* const facilities_;
  OpenWatches* const watches_;
  TimerQueue* const timers_;
  const RequestLog log_;
  const absl::Status admitted_;
  const std::shared_ptr<Gate> gate_;

  // Of whoever has the call.
  std::unique_ptr<WatchSource> source_;
  v1::WatchResponse message_;
  std::optional<ChangeFeed::WaitId> feed_wait_;
  std::optional<TimerQueue::Id> timer_;

  Mutex write_mutex_;
  bool writing_ ABSL_GUARDED_BY(write_mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_WATCH_CALL_H_
