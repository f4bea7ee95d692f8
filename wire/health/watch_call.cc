#include "wire/health/watch_call.h"

#include <utility>

#include "base/sync/cancel_scope.h"
#include "wire/health/statuses.h"

namespace hypermap::health {

WatchCall* WatchCall::Start(std::unique_ptr<reflection::Ticket> ticket,
                            const absl::StatusOr<std::string>& service, Statuses* statuses) {
  const std::shared_ptr<WatchCall> call(
      new WatchCall(std::move(ticket), service.value_or(""), statuses));
  call->self_ = call;
  if (service.ok()) {
    statuses->Add(call);
  } else {
    call->End(service.status());
  }
  return call.get();
}

WatchCall::WatchCall(std::unique_ptr<reflection::Ticket> ticket, std::string service,
                     Statuses* statuses)
    : service_(std::move(service)), statuses_(statuses), ticket_(std::move(ticket)) {}

void WatchCall::Update() {
  MutexLock lock(&mutex_);
  if (end_.has_value()) return;
  // As it is now: of two changes at a time, the later one may have come here before the other.
  const ServingStatus status = statuses_->Find(service_);
  waiting_.reset();
  if (status != sent_) waiting_ = status;
  Continue();
}

void WatchCall::End(const absl::Status& status) {
  MutexLock lock(&mutex_);
  if (!end_.has_value()) end_ = status;
  Continue();
}

void WatchCall::OnWriteDone(bool ok) {
  MutexLock lock(&mutex_);
  writing_ = false;
  message_.Clear();
  if (ok) {
    Continue();
  } else {
    EndAsGone();
  }
}

void WatchCall::OnCancel() {
  const CancelScope in_cancel(this);
  MutexLock lock(&mutex_);
  EndAsGone();
}

void WatchCall::OnDone() {
  statuses_->Remove(this);
  // Another thread may still call Update or End, which do nothing now.
  const std::shared_ptr<WatchCall> self = std::move(self_);
  MutexLock lock(&mutex_);
  ticket_.reset();
}

void WatchCall::Continue() {
  if (writing_ || finished_) return;
  if (waiting_.has_value()) {
    sent_ = std::exchange(waiting_, std::nullopt);
    Encode(*sent_).Swap(&message_);
    writing_ = true;
    StartWrite(&message_);
  } else if (end_.has_value()) {
    finished_ = true;
    Finish(ticket_->Encode(*end_));
  }
}

void WatchCall::EndAsGone() {
  waiting_.reset();
  if (!end_.has_value()) end_ = absl::CancelledError("the caller went away");
  Continue();
}

}  // namespace hypermap::health
