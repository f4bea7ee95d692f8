// One session with PostgreSQL, as the classes of this room share it. Only for the sources of this
// room.
#ifndef HYPERMAP_STORAGE_LIBPQ_SESSION_H_
#define HYPERMAP_STORAGE_LIBPQ_SESSION_H_

#include <libpq-fe.h>

#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "storage/libpq/connect.h"
#include "storage/libpq/parameters.h"

namespace hypermap::storage::postgres {

struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};
using Result = std::unique_ptr<PGresult, ClearResult>;

// The names of the statements that are prepared in a session. A name is not given twice.
class PreparedStatements {
 public:
  // Texts beyond this number are not prepared: they are sent as a whole each time. The texts of a
  // program are few, and one takes some 10 KB in the database.
  static constexpr size_t kMost = 256;

  // The name of the text, prepared for parameters of these types; empty if it has none.
  std::string Find(const std::string& sql, const std::vector<::Oid>& types) const;
  // Whether a text that has no name yet should get one.
  bool Wants(const std::string& sql) const {
    return statements_.size() < kMost && statements_.count(sql) == 0;
  }
  // Gives a name to a text that is about to be prepared.
  std::string Add(const std::string& sql, const std::vector<::Oid>& types);
  void Confirm(const std::string& sql);
  // Forgets the names whose statements were not confirmed, because they may not exist.
  void ForgetUnconfirmed();

 private:
  struct Statement {
    std::string name;
    std::vector<::Oid> types;
    bool is_confirmed = false;
  };
  std::unordered_map<std::string, Statement> statements_;
  int num_names_ = 0;
};

class Session {
 public:
  Session(Handle handle, const ConnectOptions& options);

  // Null when broken.
  PGconn* handle() const { return handle_.get(); }
  // OK, or the error with which the session broke: UNAVAILABLE.
  const absl::Status& status() const { return status_; }
  bool is_broken() const { return handle_ == nullptr; }
  bool is_in_transaction() const;
  absl::Duration response_timeout() const { return response_timeout_; }
  PreparedStatements& prepared() { return prepared_; }

  // Closes the session for this reason, and returns it. Later calls fail with UNAVAILABLE.
  absl::Status Break(const absl::Status& reason);
  // As Break, for the reason that libpq tells.
  absl::Status Lost();
  // The error of a statement that libpq did not take. Closes the session if it is lost.
  absl::Status CallError();

  // Whether the session can't be used after this result: an error that ends it, or a COPY, of whose
  // results there would be no end.
  bool IsEndedBy(const PGresult* result) const;

  // Whether a statement of this text should be prepared now, before it is sent.
  bool ShouldPrepare(const std::string& sql) const { return prepares_ && prepared_.Wants(sql); }
  // Hands a PREPARE to libpq.
  absl::Status SendPrepare(const std::string& sql, const Parameters& parameters);
  // Hands a statement to libpq, by its name if it has one.
  absl::Status SendStatement(const std::string& sql, const Parameters& parameters);

 private:
  Handle handle_;
  const absl::Duration response_timeout_;
  const bool prepares_;
  absl::Status status_;
  PreparedStatements prepared_;
};

// OK, or the error of a result. `is_commit`: the statement was to commit; it is an error if it
// rolled back.
absl::Status StatusOf(const PGresult* result, bool is_commit);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_SESSION_H_
