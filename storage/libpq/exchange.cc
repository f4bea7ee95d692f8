#include "storage/libpq/exchange.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/steady_time.h"
#include "storage/libpq/poll_interval.h"

namespace hypermap::storage::postgres {
namespace {

// How long the answer to a statement that was cancelled is waited for.
constexpr absl::Duration kCancelTimeout = absl::Seconds(5);

}  // namespace

Exchange::Exchange(Session* session, Cancelling cancelling)
    : session_(session), cancelling_(cancelling), timeout_(session->response_timeout()) {}

absl::Status Exchange::CheckCancelled() {
  if (cancelling_ == Cancelling::kForbidden || !cancelled_.ok()) return cancelled_;
  cancelled_ = hypermap::CheckCancelled();
  if (!cancelled_.ok() && !session_->is_broken()) {
    requests_ = std::make_unique<CancelRequests>(session_->handle());
    timeout_ = std::min(kCancelTimeout, timeout_);
    end_.emplace(timeout_);
  }
  return cancelled_;
}

absl::Status Exchange::Timeout() {
  // The session's end alone would not stop the statement. Nobody waits for the request.
  if (cancelling_ == Cancelling::kAllowed) CancelRequests request(session_->handle());
  return session_->Break(absl::UnavailableError(
      absl::StrCat("the database did not answer within ", absl::FormatDuration(timeout_))));
}

absl::Status Exchange::Poll(bool has_unsent) {
  const absl::Duration left = end_ ? end_->left() : timeout_ - silence_;
  if (left <= absl::ZeroDuration()) return Timeout();
  pollfd polled{PQsocket(session_->handle()),
                static_cast<int16_t>(POLLIN | (has_unsent ? POLLOUT : 0)), 0};
  const SteadyTime before = SteadyTime::Now();
  const int ready = poll(&polled, 1, PollMilliseconds(left));
  if (ready < 0 && errno != EINTR) {
    return session_->Break(absl::UnavailableError("poll failed on the database's connection"));
  }
  silence_ = ready > 0 ? absl::ZeroDuration() : silence_ + (SteadyTime::Now() - before);
  return absl::OkStatus();
}

absl::Status Exchange::Step() {
  static_cast<void>(CheckCancelled());
  if (is_lost_) return session_->Lost();
  const int unsent = PQflush(session_->handle());
  if (unsent < 0) return session_->Lost();
  HYPERMAP_RETURN_IF_ERROR(Poll(unsent == 1));
  // Also when poll has found nothing: TLS may hold bytes that have left the socket.
  is_lost_ = PQconsumeInput(session_->handle()) == 0;
  return absl::OkStatus();
}

absl::Status Exchange::Flush() {
  for (;;) {
    const int unsent = PQflush(session_->handle());
    if (unsent == 0) return absl::OkStatus();
    if (unsent < 0) return session_->Lost();
    HYPERMAP_RETURN_IF_ERROR(Step());
  }
}

absl::StatusOr<Result> Exchange::Next() {
  // The first flush is here, because libpq may be busy with nothing but unsent bytes.
  HYPERMAP_RETURN_IF_ERROR(Flush());
  while (PQisBusy(session_->handle()) != 0) HYPERMAP_RETURN_IF_ERROR(Step());
  return Result(PQgetResult(session_->handle()));
}

absl::StatusOr<Result> Exchange::ReadAnswer(bool is_commit) {
  Result last;
  absl::Status first_error;
  for (;;) {
    absl::StatusOr<Result> result = Next();
    if (!result.ok()) return End(first_error.ok() ? result.status() : first_error);
    if (*result == nullptr) break;
    first_error.Update(StatusOf(result->get(), is_commit));
    if (session_->IsEndedBy(result->get())) return End(session_->Break(first_error));
    last = *std::move(result);
  }
  HYPERMAP_RETURN_IF_ERROR(End(first_error));
  return last;
}

absl::Status Exchange::End(const absl::Status& status) {
  if (requests_ != nullptr && !session_->is_broken() &&
      !requests_->End(std::max(end_->left(), absl::ZeroDuration()))) {
    static_cast<void>(session_->Break(
        absl::UnavailableError("the database did not end a cancelled statement in time")));
  }
  requests_ = nullptr;
  return cancelled_.ok() ? status : cancelled_;
}

}  // namespace hypermap::storage::postgres
