// A C++ interface to PostgreSQL with ownership, typed values and absl::Status. This header brings
// all of it.
//
// A Connection is one session with the database and is used by one thread at a time. Values go both
// ways in binary format. Content is not trusted: a column of another type than asked for is an
// error, never a silent conversion.
//
//   HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(
//       "SELECT object_id, label FROM hypermap.objects WHERE layer = $1", layer));
//   while (rows.Next()) Use(rows.Int64(0), rows.Text(1));
//   HYPERMAP_RETURN_IF_ERROR(rows.row_status());
//
// Errors of the database are mapped by their SQLSTATE (errors.h).
//
// Every wait for the database has a bound. Calls that wait end with the error of CheckCancelled
// when the caller's work is cancelled; the statement is then cancelled in the database, too, and
// the connection stays usable unless is_broken() says otherwise. Statements that may commit are not
// cancelled once they are sent, but waited for: COMMIT, and outside of a transaction all but a
// SELECT. For where commits wait for a standby, the database reports a cancelled one as done, and
// loses it with the primary server. So a COMMIT is never reported as cancelled when it succeeded.
#ifndef HYPERMAP_STORAGE_LIBPQ_CONNECTION_H_
#define HYPERMAP_STORAGE_LIBPQ_CONNECTION_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "storage/libpq/connect_options.h"
#include "storage/libpq/copy_in.h"
#include "storage/libpq/errors.h"
#include "storage/libpq/parameters.h"
#include "storage/libpq/pipeline.h"
#include "storage/libpq/rows.h"
#include "storage/libpq/transaction.h"

namespace hypermap::storage::postgres {

class Session;

class Connection {
 public:
  // Waits up to the options' timeout. UNAVAILABLE; FAILED_PRECONDITION if the target is no
  // connection string, or the role or the database do not exist; errors of CheckCancelled.
  static absl::StatusOr<std::unique_ptr<Connection>> Open(const ConnectOptions& options);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Runs a script of statements without parameters: as one transaction, unless it has a BEGIN or
  // one is open.
  absl::Status Execute(const std::string& sql);

  template <typename... Values>
  absl::StatusOr<Rows> Query(const std::string& sql, const Values&... values) {
    return Run(sql, Parameters(values...));
  }
  absl::StatusOr<Rows> Run(const std::string& sql, const Parameters& parameters);

  // The first column of the first row; nullopt when there is no row or it is NULL.
  template <typename... Values>
  absl::StatusOr<std::optional<int64_t>> QueryInt64(const std::string& sql,
                                                    const Values&... values) {
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(sql, values...));
    return FirstInt64(rows);
  }

  // True once the session is lost. All calls fail with UNAVAILABLE from then on.
  bool is_broken() const;
  // Whether a transaction is open in the session, also one that has failed.
  bool is_in_transaction() const;

  // Waits for a notification of a channel that the session listens to, at most until the timeout:
  // its payload, or nullopt. Errors of CheckCancelled; UNAVAILABLE.
  absl::StatusOr<std::optional<std::string>> AwaitNotification(absl::Duration timeout);

 private:
  friend class CopyIn;
  friend class Pipeline;
  friend class Transaction;
  explicit Connection(std::unique_ptr<Session> session);
  static absl::StatusOr<std::optional<int64_t>> FirstInt64(Rows& rows);
  absl::Status Prepare(const std::string& sql, const Parameters& parameters);
  // Rolls the transaction back, if there is one, whether this thread's work is cancelled or not. If
  // that fails, the session is closed, which does it, too.
  void RollBack();
  // As RollBack, of a transaction that only read, but does not wait for the answer, which the next
  // statement does.
  void LeaveSnapshot();
  // Waits for the answer to what LeaveSnapshot has sent. OK when a statement can be sent.
  absl::Status Ready();

  const std::unique_ptr<Session> session_;
  bool is_leaving_ = false;  // since LeaveSnapshot
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_CONNECTION_H_
