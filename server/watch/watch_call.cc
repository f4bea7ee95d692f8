#include "server/watch/watch_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "server/rpc/wanted.h"
#include "wire/status.h"

namespace hypermap::server {

absl::Status OpenWatches::Add(WatchCall* call) {
  MutexLock lock(&mutex_);
  if (calls_.size() >= static_cast<size_t>(max_watchers_)) {
    return absl::ResourceExhaustedError(
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

bool WatchCall::WakeHandle::EndWait() {
  MutexLock lock(&mutex_);
  if (std::exchange(waiting_, false)) return true;
  woken_ = true;
  return false;
}

void WatchCall::WakeHandle::Wake() {
  if (EndWait()) call_->RunOnWorker();
}

void WatchCall::WakeHandle::WakeHere() {
  if (EndWait()) call_->TakeShortTurn();
}

void WatchCall::WakeHandle::BeginTurn() {
  MutexLock lock(&mutex_);
  woken_ = false;
}

void WatchCall::WakeHandle::BeginWait() {
  MutexLock lock(&mutex_);
  if (woken_) {
    // On a worker, because the caller may be a gRPC thread, which must not be held up.
    call_->RunOnWorker();
  } else {
    waiting_ = true;
  }
}

WatchCall::WatchCall(const grpc::CallbackServerContext* context, v1::WatchRequest request,
                     const Facilities* facilities, WatchGroups* groups, OpenWatches* watches,
                     TimerQueue* timers, const TickQueues* tick_queues)
    : context_(context),
      request_(std::move(request)),
      facilities_(facilities),
      groups_(groups),
      watches_(watches),
      timers_(timers),
      tick_queues_(tick_queues),
      log_(*context, "Watch", request_.scope().map()),
      admitted_(watches->Add(this)),
      wake_handle_(std::make_shared<WakeHandle>(this)) {
  RunOnWorker();
}

void WatchCall::OnWriteDone(bool ok) {
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
  for (int i = 0; i < kBegunForOne && tick_queues_->RunNext(); ++i) {
  }
}

void WatchCall::OnDone() {
  watches_->Remove(this);
  delete this;
}

void WatchCall::CancelWrite() {
  // While the lock is held and writing_ is set, OnWriteDone can't go on, so that the context is
  // valid.
  MutexLock lock(&write_mutex_);
  if (writing_) context_->TryCancel();
}

void WatchCall::RunOnWorker() {
  facilities_->workers->Run([this] { TakeTurn(); });
}

void WatchCall::TakeTurn() {
  wake_handle_->BeginTurn();
  ForgetWait();
  absl::Time now = absl::Now();
  const absl::Time end_of_turn = now + kTurn;
  for (; now < end_of_turn; now = absl::Now()) {
    grpc::Slice message;
    const absl::StatusOr<WatchSource::Step> step = TakeStep(now, &message);
    if (!step.ok()) return End(step.status());
    if (*step == WatchSource::Step::kNothingNew) return WaitForCommits(now);
    if (*step == WatchSource::Step::kMessage) return Write(message);
  }
  RunOnWorker();
}

void WatchCall::TakeShortTurn() {
  wake_handle_->BeginTurn();
  grpc::Slice message;
  if (CheckWanted(*context_).ok() && source_->TakeShared(absl::Now(), &message)) {
    Write(message);
  } else {
    RunOnWorker();
  }
}

void WatchCall::Write(const grpc::Slice& message) {
  grpc::ByteBuffer(&message, 1).Swap(&message_);
  {
    MutexLock lock(&write_mutex_);
    writing_ = true;
  }
  StartWrite(&message_);
}

absl::StatusOr<WatchSource::Step> WatchCall::TakeStep(absl::Time now, grpc::Slice* message) {
  HYPERMAP_RETURN_IF_ERROR(CheckWanted(*context_));
  if (!admitted_.ok()) return admitted_;
  if (!source_) {
    HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<WatchSource> source,
                              WatchSource::Open(*facilities_, groups_, request_));
    source_ = std::move(source);
  }
  return source_->Next(now, message);
}

void WatchCall::WaitForCommits(absl::Time now) {
  const std::shared_ptr<WakeHandle> wake_handle = wake_handle_;
  const auto wake = [wake_handle] { wake_handle->Wake(); };
  feed_wait_ = source_->feed().Await(source_->taken(), wake);
  timer_ = timers_->RunAfter(source_->idle_for(now), wake);
  wake_handle->BeginWait();
}

void WatchCall::WaitForTick() {
  const std::shared_ptr<WakeHandle> wake_handle = wake_handle_;
  const std::shared_ptr<TickQueue>& line =
      source_->is_busy() ? tick_queues_->busy : tick_queues_->calm;
  line->Add([wake_handle] { wake_handle->WakeHere(); });
  wake_handle->BeginWait();
}

void WatchCall::ForgetWait() {
  if (feed_wait_) source_->feed().Remove(*std::exchange(feed_wait_, std::nullopt));
  if (timer_) timers_->Cancel(*std::exchange(timer_, std::nullopt));
}

void WatchCall::End(const absl::Status& status) {
  log_.Finished(status, source_ ? source_->items() : 0);
  Finish(wire::EncodeStatus(status));
}

}  // namespace hypermap::server
