// One Watch, Replicate or WatchRobots rpc, from its start to its end.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_CALL_H_
#define HYPERMAP_SERVER_WATCH_WATCH_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/slice.h>

#include <memory>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "base/sync/cancel_scope.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "server/rpc/budgets.h"
#include "server/rpc/call_context.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/facilities.h"
#include "server/rpc/forwarded_answer.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/timer_queue.h"
#include "server/rpc/worker_pool.h"
#include "server/watch/live_source.h"
#include "server/watch/open_watches.h"
#include "server/watch/tick_queue.h"
#include "server/watch/wake_handle.h"
#include "server/watch/watch_tuning.h"

namespace hypermap::server {

// Writes the messages of a LiveSource, one at a time: the next when gRPC has taken the last. When
// there is nothing new, the call waits for its source, a timer or the end of the rpc, and holds
// no thread. A call that may coalesce and has reached the newest state waits for a tick of a
// clock that all calls share, so that the watches of a group reach the same commit at the same time
// and write the same bytes.
//
// The call has one owner at any time, and only the owner may touch it: a worker (or the worker
// pool's queue); or gRPC during a write, until OnWriteDone goes on or begins to wait; or the wake
// handle while the call waits. The call deletes itself in OnDone. Finish is called on a worker
// only, unless only the owner of the map can answer, which is another server: then the messages and
// the end are the owner's.
class WatchCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  // The state that all calls of a service share. Thread safe.
  struct Shared {
    // The pointers in `facilities` must outlive this.
    Shared(const WatchTuning& tuning_values, const Facilities& facilities);

    const WatchTuning tuning;
    const CallFacilities call_facilities;
    WorkerPool* const workers;
    Budgets* const budgets;
    OpenWatches open_watches;
    TimerQueue timers;
    const TickQueues tick_queues;
  };

  // Charges the call's ticket for the arrival of the request.
  using ChargeRequest = absl::FunctionRef<absl::Status(CallTicket&)>;
  // Charges the rest, parses the request, enters its map, and opens the source.
  using OpenSource =
      absl::AnyInvocable<absl::StatusOr<std::unique_ptr<LiveSource>>(CallContext&) &&>;

  // `bytes` are the request. `charge_request` is called by the constructor if there is room for
  // another call, and `open_source` later, once, on a worker; it frees what the request holds. The
  // error of either ends the rpc. `shared` must outlive this; the context and the bytes live until
  // OnDone.
  WatchCall(grpc::CallbackServerContext* context, Rpc rpc, const grpc::ByteBuffer& bytes,
            ChargeRequest charge_request, OpenSource open_source, Shared* shared);

  void OnWriteDone(bool ok) override;
  void OnCancel() override {
    const CancelScope in_cancel(this);
    wake_handle_->Wake();
  }
  void OnDone() override;

  // Cancels the rpc if a write is under way, or if the owner of the map answers: the client gets
  // CANCELLED and no revision to resume from.
  void CancelWrite();
  // Returns whether the call must go on, as far as its caller is concerned.
  bool IsWanted() const { return context_.CheckWanted().ok(); }
  // Ends the wait of the call, if it waits.
  void Wake() { wake_handle_->Wake(); }

 private:
  absl::Status Admit(ChargeRequest charge_request);
  void RunOnWorker();
  // Takes steps until there is a message to write, or nothing to do, or the time of a turn has
  // passed.
  void TakeTurn();
  // Writes the group's next message if it has one; otherwise leaves the turn to a worker. Short
  // enough for gRPC's threads.
  void TakeShortTurn();
  // Gives up the step when the caller has gone.
  absl::StatusOr<LiveSource::Step> TakeStep(SteadyTime now, grpc::Slice* message);
  absl::StatusOr<LiveSource::Step> MakeStep(SteadyTime now, grpc::Slice* message);
  void Write(const grpc::Slice& message);
  void WaitForNews(SteadyTime now);
  void WaitForTick();
  // Removes the callbacks that the last wait left in the source and the timers.
  void ForgetWait();
  void End(const absl::Status& status);
  void PassOn(Forwarding forwarding);

  const grpc::CallbackServerContext* const grpc_context_;
  const grpc::ByteBuffer& bytes_;
  Shared* const shared_;
  CallContext context_;
  admission::Budget::Charge place_;  // among budgets->watchers
  const absl::Status admitted_;      // by context_ and budgets->watchers
  const std::shared_ptr<WakeHandle> wake_handle_;

  // Used by the owner of the call only.
  OpenSource open_source_;                 // null once it was called
  MemoryMeter meter_{&context_.ticket()};  // of the past commits that source_ holds
  std::unique_ptr<LiveSource> source_;     // null until the first turn
  grpc::ByteBuffer message_;
  bool has_answered_ = false;
  std::optional<ForwardedAnswer> forwarded_;
  std::optional<TimerQueue::Id> timer_;

  Mutex write_mutex_;
  bool writing_ ABSL_GUARDED_BY(write_mutex_) = false;
};

// Begins an rpc that owns itself. The request is refused if it is not `acceptable`; otherwise
// `open(request)` makes its source, on a worker, or returns the error with which the rpc ends.
template <typename Request, typename Open>
WatchCall* BeginWatchCall(grpc::CallbackServerContext* context, Rpc rpc,
                          const grpc::ByteBuffer& bytes, const absl::Status& acceptable, Open open,
                          WatchCall::Shared* shared) {
  const auto charge_request = [&](CallTicket& ticket) -> absl::Status {
    ticket.Received(bytes);
    HYPERMAP_RETURN_IF_ERROR(acceptable);
    return ticket.ChargeArrival(Request::default_instance(), bytes);
  };
  // gRPC keeps the bytes until OnDone.
  const auto open_source =
      [&bytes, open](CallContext& call) -> absl::StatusOr<std::unique_ptr<LiveSource>> {
    Request request;
    HYPERMAP_RETURN_IF_ERROR(call.ticket().ChargeRest(request, bytes));
    HYPERMAP_RETURN_IF_ERROR(ParseRequest(bytes, &request));
    HYPERMAP_RETURN_IF_ERROR(call.EnterMap(MapOf(request)));
    return open(request);
  };
  return new WatchCall(context, rpc, bytes, charge_request, open_source, shared);
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_CALL_H_
