#include "server/watch/watch_call.h"

#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/steady_time.h"

namespace hypermap::server {

WatchCall::Shared::Shared(const WatchTuning& tuning_values, const Facilities& facilities)
    : tuning(tuning_values),
      call_facilities(facilities.for_calls()),
      workers(&facilities.workers->watches),
      budgets(facilities.budgets),
      tick_queues{TickQueue::Make(tuning.calm_tick, tuning.turn, &timers, workers),
                  TickQueue::Make(tuning.busy_tick, tuning.turn, &timers, workers)} {}

WatchCall::WatchCall(grpc::CallbackServerContext* context, Rpc rpc, const grpc::ByteBuffer& bytes,
                     ChargeRequest charge_request, OpenSource open_source, Shared* shared)
    : grpc_context_(context),
      bytes_(bytes),
      shared_(shared),
      context_(shared->call_facilities, context, rpc),
      place_(&shared->budgets->watchers, context_.ticket().client()),
      admitted_(Admit(charge_request)),
      wake_handle_(
          std::make_shared<WakeHandle>([this] { RunOnWorker(); }, [this] { TakeShortTurn(); })),
      open_source_(std::move(open_source)) {
  RunOnWorker();
}

absl::Status WatchCall::Admit(ChargeRequest charge_request) {
  HYPERMAP_RETURN_IF_ERROR(context_.admitted());
  HYPERMAP_RETURN_IF_ERROR(place_.Add(1));
  shared_->open_watches.Add(this);
  return charge_request(context_.ticket());
}

void WatchCall::OnWriteDone(bool ok) {
  if (forwarded_) return forwarded_->OnWriteDone(ok);
  {
    MutexLock lock(&write_mutex_);
    writing_ = false;
  }
  // A write fails only if the rpc was cancelled; then a worker ends the call.
  if (ok && source_->gathers()) {
    WaitForTick();
  } else {
    RunOnWorker();
  }
  // This gRPC thread is awake: it starts writes of waiting calls, because waking another thread
  // costs as much as a write.
  for (int i = 0; i < shared_->tuning.writes_begun_per_write && shared_->tick_queues.RunNext();
       ++i) {
  }
}

void WatchCall::OnDone() {
  shared_->open_watches.Remove(this);
  delete this;
}

void WatchCall::CancelWrite() {
  // While the lock is held and writing_ is set, OnWriteDone can't go on, so that the context is
  // valid.
  MutexLock lock(&write_mutex_);
  if (writing_) grpc_context_->TryCancel();
}

void WatchCall::RunOnWorker() {
  shared_->workers->Run(context_.origin(), [this] { TakeTurn(); });
}

void WatchCall::TakeTurn() {
  wake_handle_->BeginTurn();
  ForgetWait();
  SteadyTime now = SteadyTime::Now();
  const SteadyTime end_of_turn = now + shared_->tuning.turn;
  for (; now < end_of_turn; now = SteadyTime::Now()) {
    grpc::Slice message;
    const absl::StatusOr<LiveSource::Step> step = TakeStep(now, &message);
    if (!step.ok()) return End(step.status());
    if (*step == LiveSource::Step::kNothingNew) return WaitForNews(now);
    if (*step == LiveSource::Step::kMessage) return Write(message);
  }
  RunOnWorker();
}

void WatchCall::TakeShortTurn() {
  wake_handle_->BeginTurn();
  grpc::Slice message;
  if (context_.CheckWanted().ok() && source_->TakeShared(SteadyTime::Now(), &message)) {
    Write(message);
  } else {
    RunOnWorker();
  }
}

void WatchCall::Write(const grpc::Slice& message) {
  has_answered_ = true;
  grpc::ByteBuffer(&message, 1).Swap(&message_);
  {
    MutexLock lock(&write_mutex_);
    writing_ = true;
  }
  StartWrite(&message_);
}

absl::StatusOr<LiveSource::Step> WatchCall::TakeStep(SteadyTime now, grpc::Slice* message) {
  Cancellation cancellation([this] { return context_.CheckWanted(); });
  const ScopedCancellation here(&cancellation);
  const ScopedMeter metered(&meter_);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  absl::StatusOr<LiveSource::Step> step = MakeStep(now, message);
  // Work that was given up has no result.
  HYPERMAP_RETURN_IF_ERROR(cancellation.status());
  return step;
}

absl::StatusOr<LiveSource::Step> WatchCall::MakeStep(SteadyTime now, grpc::Slice* message) {
  if (!admitted_.ok()) return admitted_;
  if (open_source_) {
    OpenSource open_source = std::exchange(open_source_, nullptr);
    HYPERMAP_ASSIGN_OR_RETURN(source_, std::move(open_source)(context_));
    // From now on the call holds its filter instead of the request.
    meter_.GiveBack();
    context_.ticket().FreeMemory(context_.ticket().memory());
    if (source_->memory() > CallTicket::kFreeBytes) {
      HYPERMAP_RETURN_IF_ERROR(context_.ticket().ChargeMemory(source_->memory()));
    }
  }
  if (!source_->holds_commits()) meter_.GiveBack();
  return source_->Next(now, message);
}

void WatchCall::WaitForNews(SteadyTime now) {
  const std::shared_ptr<WakeHandle> wake_handle = wake_handle_;
  source_->BeginWait(wake_handle);
  timer_ = shared_->timers.RunAfter(source_->idle_for(now), [wake_handle] { wake_handle->Wake(); });
  wake_handle->BeginWait();
}

void WatchCall::WaitForTick() {
  const std::shared_ptr<WakeHandle> wake_handle = wake_handle_;
  const std::shared_ptr<TickQueue>& queue =
      source_->is_busy() ? shared_->tick_queues.busy : shared_->tick_queues.calm;
  queue->Add([wake_handle] { wake_handle->WakeHere(); });
  wake_handle->BeginWait();
}

void WatchCall::ForgetWait() {
  if (source_) source_->EndWait();
  if (timer_) shared_->timers.Cancel(*std::exchange(timer_, std::nullopt));
}

void WatchCall::End(const absl::Status& status) {
  if (!has_answered_) {
    if (auto forwarding = context_.ForwardInsteadOf(status)) return PassOn(*std::move(forwarding));
  }
  Finish(context_.End(status, source_ ? source_->items() : 0));
}

void WatchCall::PassOn(Forwarding forwarding) {
  source_.reset();
  forwarded_.emplace(this, &context_, std::move(forwarding));
  {
    // From now on CancelWrite ends the call: its twin is cancelled together with it.
    const MutexLock lock(&write_mutex_);
    writing_ = true;
  }
  forwarded_->Start(bytes_);
}

}  // namespace hypermap::server
