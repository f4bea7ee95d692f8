#include "server/services/watch_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/services/wanted.h"
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

void WatchCall::Gate::Wake() {
  MutexLock lock(&mutex_);
  if (!waiting_) {
    woken_ = true;
    return;
  }
  waiting_ = false;
  workers_->Run([call = call_] { call->TakeTurn(); });
}

void WatchCall::Gate::BeginTurn() {
  MutexLock lock(&mutex_);
  woken_ = false;
}

bool WatchCall::Gate::BeginWait() {
  MutexLock lock(&mutex_);
  if (woken_) return false;
  waiting_ = true;
  return true;
}

WatchCall::WatchCall(const grpc::CallbackServerContext* context, const v1::WatchRequest* request,
                     const Facilities* facilities, OpenWatches* watches, TimerQueue* timers)
    : context_(context),
      request_(request),
      facilities_(facilities),
      watches_(watches),
      timers_(timers),
      log_(*context, "Watch", request->map()),
      admitted_(watches->Add(this)),
      gate_(std::make_shared<Gate>(this, facilities->workers)) {
  facilities_->workers->Run([this] { TakeTurn(); });
}

void WatchCall::OnWriteDone(bool /*ok*/) {
  {
    MutexLock lock(&write_mutex_);
    writing_ = false;
  }
  // A write that failed is that of a call which was cancelled.
  facilities_->workers->Run([this] { TakeTurn(); });
}

void WatchCall::OnDone() {
  watches_->Remove(this);
  delete this;
}

void WatchCall::CancelWrite() {
  // While it is locked the write is not done, and the call not at its end.
  MutexLock lock(&write_mutex_);
  if (writing_) context_->TryCancel();
}

void WatchCall::TakeTurn() {
  gate_->BeginTurn();
  ForgetWait();
  absl::Time now = absl::Now();
  const absl::Time end_of_turn = now + kTurn;
  for (; now < end_of_turn; now = absl::Now()) {
    const absl::StatusOr<WatchSource::Step> step = TakeStep(now);
    if (!step.ok()) return End(step.status());
    if (*step == WatchSource::Step::kNothingNew) return Wait(now);
    if (*step == WatchSource::Step::kNothingYet) continue;
    {
      MutexLock lock(&write_mutex_);
      writing_ = true;
    }
    return StartWrite(&message_);
  }
  facilities_->workers->Run([this] { TakeTurn(); });
}

absl::StatusOr<WatchSource::Step> WatchCall::TakeStep(absl::Time now) {
  if (absl::Status status = CheckWanted(*context_); !status.ok()) return status;
  if (!admitted_.ok()) return admitted_;
  if (!source_) {
    absl::StatusOr<std::unique_ptr<WatchSource>> source =
        WatchSource::Open(*facilities_, *request_);
    if (!source.ok()) return source.status();
    source_ = *std::move(source);
  }
  message_.Clear();
  return source_->Next(now, &message_);
}

void WatchCall::Wait(absl::Time now) {
  const auto wake = [gate = gate_] { gate->Wake(); };
  feed_wait_ = source_->feed().Await(source_->taken(), wake);
  timer_ = timers_->RunAfter(source_->idle_for(now), wake);
  if (!gate_->BeginWait()) facilities_->workers->Run([this] { TakeTurn(); });
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
