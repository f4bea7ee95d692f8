#include "storage/libpq/transaction.h"

#include <utility>

#include "base/status/status_macros.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

absl::StatusOr<Transaction> Transaction::Begin(Connection* connection, Kind kind) {
  HYPERMAP_RETURN_IF_ERROR(connection->Execute(BeginStatement(kind)));
  return Transaction(connection, kind);
}

std::string Transaction::BeginStatement(Kind kind) {
  return kind == Kind::kSnapshot ? "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY" : "BEGIN";
}

Transaction::Transaction(Transaction&& other) noexcept
    : connection_(std::exchange(other.connection_, nullptr)), kind_(other.kind_) {}

Transaction::~Transaction() {
  if (connection_ == nullptr) return;
  if (kind_ == Kind::kSnapshot) {
    connection_->LeaveSnapshot();
  } else {
    connection_->RollBack();
  }
}

absl::Status Transaction::Commit() {
  // Another error has rolled back already; COMMIT would only be warned of.
  if (!connection_->is_broken() && !connection_->is_in_transaction()) {
    return absl::InternalError("COMMIT of a transaction that had failed");
  }
  HYPERMAP_RETURN_IF_ERROR(connection_->Execute("COMMIT"));
  connection_ = nullptr;
  return absl::OkStatus();
}

}  // namespace hypermap::storage::postgres
