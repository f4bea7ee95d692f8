// Transactions of PostgreSQL.
#ifndef HYPERMAP_STORAGE_LIBPQ_TRANSACTION_H_
#define HYPERMAP_STORAGE_LIBPQ_TRANSACTION_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::storage::postgres {

class Connection;

// A transaction; rolled back unless committed. A connection has one at a time, and must outlive it.
class Transaction {
 public:
  enum class Kind {
    kReadWrite,
    kSnapshot,  // read only; all reads see the state at the time of the first of them
  };
  static absl::StatusOr<Transaction> Begin(Connection* connection, Kind kind = Kind::kReadWrite);
  // For a transaction that begins in a Pipeline, with what else is sent: its first statement, and,
  // after Finish has returned OK, the transaction.
  static std::string BeginStatement(Kind kind);
  static Transaction Begun(Connection* connection, Kind kind) {
    return Transaction(connection, kind);
  }
  Transaction(Transaction&& other) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();

  // On error nothing is committed, but if the connection broke it is not known. INTERNAL if a
  // statement of the transaction had failed.
  absl::Status Commit();

 private:
  Transaction(Connection* connection, Kind kind) : connection_(connection), kind_(kind) {}
  Connection* connection_;  // null when committed or moved from
  Kind kind_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_TRANSACTION_H_
