#include "storage/libpq/connection.h"

#include <poll.h>

#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/sync/deadline.h"
#include "storage/libpq/exchange.h"
#include "storage/libpq/poll_interval.h"
#include "storage/libpq/session.h"
#include "storage/libpq/statements.h"

namespace hypermap::storage::postgres {
namespace {

struct FreeNotification {
  void operator()(PGnotify* notification) const { PQfreemem(notification); }
};

Exchange::Cancelling CancellingOf(const std::string& sql, const Session& session) {
  return MayCommit(sql, session.is_in_transaction()) ? Exchange::Cancelling::kForbidden
                                                     : Exchange::Cancelling::kAllowed;
}

}  // namespace

Connection::Connection(std::unique_ptr<Session> session) : session_(std::move(session)) {}

Connection::~Connection() = default;

absl::StatusOr<std::unique_ptr<Connection>> Connection::Open(const ConnectOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(Handle handle, Connect(options));
  return std::unique_ptr<Connection>(
      new Connection(std::make_unique<Session>(std::move(handle), options)));
}

absl::Status Connection::Execute(const std::string& sql) {
  HYPERMAP_RETURN_IF_ERROR(Ready());
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  Exchange exchange(session_.get(), CancellingOf(sql, *session_));
  if (PQsendQuery(session_->handle(), sql.c_str()) != 1) return session_->CallError();
  return exchange.ReadAnswer(IsCommit(sql)).status();
}

absl::StatusOr<Rows> Connection::Run(const std::string& sql, const Parameters& parameters) {
  HYPERMAP_RETURN_IF_ERROR(parameters.status());
  HYPERMAP_RETURN_IF_ERROR(Ready());
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (session_->ShouldPrepare(sql)) HYPERMAP_RETURN_IF_ERROR(Prepare(sql, parameters));
  Exchange exchange(session_.get(), CancellingOf(sql, *session_));
  HYPERMAP_RETURN_IF_ERROR(session_->SendStatement(sql, parameters));
  HYPERMAP_ASSIGN_OR_RETURN(Result result, exchange.ReadAnswer(IsCommit(sql)));
  return Rows(result.release());
}

absl::Status Connection::Prepare(const std::string& sql, const Parameters& parameters) {
  Exchange exchange(session_.get(), Exchange::Cancelling::kAllowed);
  absl::Status status = session_->SendPrepare(sql, parameters);
  if (status.ok()) status = exchange.ReadAnswer(/*is_commit=*/false).status();
  if (status.ok()) session_->prepared().Confirm(sql);
  session_->prepared().ForgetUnconfirmed();
  return status;
}

absl::StatusOr<std::optional<int64_t>> Connection::FirstInt64(Rows& rows) {
  if (!rows.Next()) return std::nullopt;
  const std::optional<int64_t> value = rows.OptionalInt64(0);
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return value;
}

bool Connection::is_broken() const { return session_->is_broken(); }

bool Connection::is_in_transaction() const { return session_->is_in_transaction(); }

absl::StatusOr<std::optional<std::string>> Connection::AwaitNotification(absl::Duration timeout) {
  HYPERMAP_RETURN_IF_ERROR(Ready());
  const Deadline deadline(timeout);
  for (;;) {
    HYPERMAP_RETURN_IF_ERROR(session_->status());
    const bool is_lost = PQconsumeInput(session_->handle()) == 0;
    const std::unique_ptr<PGnotify, FreeNotification> notification(PQnotifies(session_->handle()));
    if (notification != nullptr) return std::string(notification->extra);
    if (is_lost) return session_->Lost();
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (deadline.has_passed()) return std::nullopt;
    pollfd polled{PQsocket(session_->handle()), POLLIN, 0};
    poll(&polled, 1, PollMilliseconds(deadline.left()));
  }
}

absl::Status Connection::Ready() {
  if (!is_leaving_) return session_->status();
  is_leaving_ = false;
  const ScopedCancellation to_the_end(nullptr);
  Exchange exchange(session_.get(), Exchange::Cancelling::kForbidden);
  const absl::Status status = exchange.ReadAnswer(/*is_commit=*/false).status();
  if (!status.ok()) static_cast<void>(session_->Break(status));
  return session_->status();
}

void Connection::LeaveSnapshot() {
  if (is_broken() || !is_in_transaction()) return;
  if (PQsendQuery(session_->handle(), "ROLLBACK") == 1) {
    is_leaving_ = true;
  } else {
    static_cast<void>(session_->Break(session_->CallError()));
  }
}

void Connection::RollBack() {
  if (is_broken() || !is_in_transaction()) return;
  const ScopedCancellation to_the_end(nullptr);
  const absl::Status status = Execute("ROLLBACK");
  if (!status.ok()) static_cast<void>(session_->Break(status));
}

}  // namespace hypermap::storage::postgres
