#include "storage/libpq/copy_in.h"

#include <utility>

#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/exchange.h"
#include "storage/libpq/session.h"
#include "storage/libpq/wire.h"

namespace hypermap::storage::postgres {
namespace {

constexpr size_t kBufferBytes = 64 << 10;

// The signature of the format, its flags, and the length of further headers.
constexpr absl::string_view kHeader("PGCOPY\n\377\r\n\0\0\0\0\0\0\0\0\0", 19);

}  // namespace

CopyIn::CopyIn(Connection* connection, std::unique_ptr<Exchange> exchange)
    : connection_(connection), exchange_(std::move(exchange)), buffer_(kHeader) {}

Session& CopyIn::session() { return *connection_->session_; }

absl::StatusOr<std::unique_ptr<CopyIn>> CopyIn::Begin(Connection* connection,
                                                      const std::string& sql) {
  Session& session = *connection->session_;
  HYPERMAP_RETURN_IF_ERROR(connection->Ready());
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  auto exchange = std::make_unique<Exchange>(&session, Exchange::Cancelling::kAllowed);
  if (PQsendQuery(session.handle(), sql.c_str()) != 1) return session.CallError();
  const absl::StatusOr<Result> result = exchange->Next();
  if (!result.ok()) return exchange->End(result.status());
  if (PQresultStatus(result->get()) == PGRES_COPY_IN) {
    return std::unique_ptr<CopyIn>(new CopyIn(connection, std::move(exchange)));
  }
  absl::Status status = StatusOf(result->get(), /*is_commit=*/false);
  status.Update(absl::InternalError("not a COPY FROM STDIN"));
  if (session.IsEndedBy(result->get())) return exchange->End(session.Break(status));
  // The rest of the answer.
  static_cast<void>(exchange->ReadAnswer(/*is_commit=*/false));
  return exchange->End(status);
}

CopyIn::~CopyIn() {
  if (exchange_ == nullptr) return;
  const ScopedCancellation to_the_end(nullptr);
  static_cast<void>(End("the copy was given up"));
}

absl::Status CopyIn::Send(const Parameters& row) {
  HYPERMAP_RETURN_IF_ERROR(status_);
  status_ = row.status();
  HYPERMAP_RETURN_IF_ERROR(status_);
  AppendBigEndian(static_cast<int16_t>(row.values().size()), &buffer_);
  for (const Parameters::Value& value : row.values()) {
    AppendBigEndian(value.is_null ? -1 : static_cast<int32_t>(value.bytes.size()), &buffer_);
    buffer_ += value.bytes;
  }
  if (buffer_.size() >= kBufferBytes) status_ = SendBuffer();
  return status_;
}

absl::Status CopyIn::SendBuffer() {
  HYPERMAP_RETURN_IF_ERROR(exchange_->CheckCancelled());
  PGconn* const handle = session().handle();
  int taken = 0;
  while ((taken = PQputCopyData(handle, buffer_.data(), static_cast<int>(buffer_.size()))) == 0) {
    HYPERMAP_RETURN_IF_ERROR(exchange_->Step());
  }
  if (taken < 0) return session().CallError();
  buffer_.clear();
  return exchange_->Flush();
}

absl::Status CopyIn::Finish() {
  if (exchange_ == nullptr) return status_;
  AppendBigEndian(int16_t{-1}, &buffer_);
  if (status_.ok()) status_ = SendBuffer();
  if (status_.ok()) status_ = exchange_->CheckCancelled();
  if (!status_.ok()) {
    static_cast<void>(End("the copy was given up"));
    return status_;
  }
  if (!connection_->is_in_transaction()) exchange_->ForbidCancelling();
  return status_ = End(nullptr);
}

absl::Status CopyIn::End(const char* message) {
  const std::unique_ptr<Exchange> exchange = std::move(exchange_);
  absl::Status status = session().status();
  int taken = 0;
  while (status.ok() && (taken = PQputCopyEnd(session().handle(), message)) == 0) {
    status = exchange->Step();
  }
  if (status.ok() && taken < 0) status = session().CallError();
  if (!status.ok()) return exchange->End(status);
  return exchange->ReadAnswer(/*is_commit=*/false).status();
}

}  // namespace hypermap::storage::postgres
