#include "storage/libpq/pipeline.h"

#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/exchange.h"
#include "storage/libpq/session.h"
#include "storage/libpq/statements.h"

namespace hypermap::storage::postgres {
namespace {

// So much is given to libpq before it is sent. A packet of a statement has some 100 bytes besides
// its values.
constexpr size_t kMostKeptBytes = 64 << 10;
constexpr size_t kPacketBytes = 100;

size_t BytesOf(const Parameters& parameters) {
  size_t bytes = kPacketBytes;
  for (const Parameters::Value& value : parameters.values()) bytes += value.bytes.size();
  return bytes;
}

}  // namespace

Pipeline::Pipeline(Connection* connection)
    : connection_(connection), in_transaction_(connection->is_in_transaction()) {
  unsent_ = connection->Ready();
  if (!unsent_.ok()) return;
  if (PQenterPipelineMode(session().handle()) != 1) {
    unsent_ = session().CallError();
    return;
  }
  exchange_ = std::make_unique<Exchange>(&session(), Exchange::Cancelling::kAllowed);
}

Pipeline::~Pipeline() {
  if (exchange_ == nullptr) return;
  const ScopedCancellation to_the_end(nullptr);
  unsent_.Update(absl::CancelledError("the pipeline was given up"));
  static_cast<void>(Finish());
}

Session& Pipeline::session() { return *connection_->session_; }

void Pipeline::Send(const std::string& sql, const Parameters& parameters) {
  // The database would skip it, or it would be rolled back.
  if (!unsent_.ok() || !failure_.ok()) return;
  unsent_ = parameters.status();
  unsent_.Update(exchange_->CheckCancelled());
  if (unsent_.ok()) unsent_ = Queue(sql, parameters);
}

absl::Status Pipeline::Queue(const std::string& sql, const Parameters& parameters) {
  const bool is_commit = IsCommit(sql);
  if (is_commit) exchange_->ForbidCancelling();
  in_transaction_ = IsBegin(sql) || (in_transaction_ && !is_commit);
  if (session().ShouldPrepare(sql)) {
    HYPERMAP_RETURN_IF_ERROR(session().SendPrepare(sql, parameters));
    unanswered_.push_back({sql});
  }
  HYPERMAP_RETURN_IF_ERROR(session().SendStatement(sql, parameters));
  unanswered_.push_back({.is_commit = is_commit, .is_asked = is_asked_});
  return SendIfFull(BytesOf(parameters));
}

absl::Status Pipeline::SendIfFull(size_t more_bytes) {
  kept_bytes_ += more_bytes;
  if (kept_bytes_ < kMostKeptBytes) return absl::OkStatus();
  kept_bytes_ = 0;
  for (;;) {
    // Answers are read in between: the database takes nothing while it can't send them.
    HYPERMAP_RETURN_IF_ERROR(ReadResults());
    const int unsent = PQflush(session().handle());
    if (unsent == 0) return absl::OkStatus();
    HYPERMAP_RETURN_IF_ERROR(exchange_->Step());
  }
}

void Pipeline::Flush() {
  if (!unsent_.ok() || !failure_.ok()) return;
  if (PQsendFlushRequest(session().handle()) != 1) unsent_ = session().CallError();
}

absl::StatusOr<Rows> Pipeline::NextRows() {
  absl::Status status = exchange_ == nullptr ? unsent_ : SendEnd();
  while (status.ok() && rows_.empty() && !unanswered_.empty()) {
    status = ReadResults();
    if (status.ok() && rows_.empty() && !unanswered_.empty()) status = exchange_->Step();
  }
  if (status.ok() && !rows_.empty()) {
    Rows rows = std::move(rows_.front());
    rows_.pop_front();
    return rows;
  }
  if (exchange_ != nullptr) status = Close(status);
  if (status.ok()) status = absl::InternalError("nothing else was asked for");
  return status;
}

absl::Status Pipeline::Finish() {
  if (exchange_ == nullptr) return unsent_;
  return Close(Complete());
}

absl::Status Pipeline::SendEnd() {
  if (is_ended_) return absl::OkStatus();
  is_ended_ = true;
  HYPERMAP_RETURN_IF_ERROR(session().status());
  unsent_.Update(exchange_->CheckCancelled());
  PGconn* const handle = session().handle();
  if (!unsent_.ok()) {
    // Ends the transaction without an error, also the one that has no BEGIN.
    if (PQsendQueryParams(handle, "ROLLBACK", 0, nullptr, nullptr, nullptr, nullptr, 1) != 1) {
      return session().CallError();
    }
    unanswered_.push_back({});
  } else if (!in_transaction_) {
    // The end of the pipeline commits.
    exchange_->ForbidCancelling();
  }
  if (PQpipelineSync(handle) != 1) return session().CallError();
  unanswered_.push_back({});
  return absl::OkStatus();
}

absl::Status Pipeline::Complete() {
  HYPERMAP_RETURN_IF_ERROR(SendEnd());
  for (;;) {
    HYPERMAP_RETURN_IF_ERROR(ReadResults());
    if (unanswered_.empty()) return absl::OkStatus();
    HYPERMAP_RETURN_IF_ERROR(exchange_->Step());
  }
}

absl::Status Pipeline::ReadResults() {
  PGconn* const handle = session().handle();
  while (!unanswered_.empty() && PQisBusy(handle) == 0) {
    Result result(PQgetResult(handle));
    Command& command = unanswered_.front();
    // The results of each command but the last one end with a null.
    if (result == nullptr) {
      unanswered_.pop_front();
      continue;
    }
    const ExecStatusType kind = PQresultStatus(result.get());
    if (kind == PGRES_PIPELINE_SYNC) {
      unanswered_.clear();
    } else if (kind != PGRES_PIPELINE_ABORTED) {
      failure_.Update(StatusOf(result.get(), command.is_commit));
      if (session().IsEndedBy(result.get())) return session().Break(failure_);
      if (kind == PGRES_COMMAND_OK && !command.prepares.empty()) {
        session().prepared().Confirm(command.prepares);
      }
      if (kind == PGRES_TUPLES_OK && command.is_asked) rows_.emplace_back(result.release());
    }
  }
  return absl::OkStatus();
}

absl::Status Pipeline::Close(absl::Status status) {
  if (status.ok() && PQexitPipelineMode(session().handle()) != 1) {
    status = session().Break(absl::InternalError("libpq can't leave its pipeline mode"));
  }
  // An error before the last answer, of which libpq's state is not known.
  if (!status.ok()) static_cast<void>(session().Break(status));
  session().prepared().ForgetUnconfirmed();
  if (!failure_.ok()) status = failure_;
  status = exchange_->End(status);
  exchange_ = nullptr;
  if (status.ok()) status = unsent_;
  if (!status.ok()) connection_->RollBack();
  return status;
}

}  // namespace hypermap::storage::postgres
