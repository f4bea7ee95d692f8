// Many statements in one round trip.
#ifndef HYPERMAP_STORAGE_LIBPQ_PIPELINE_H_
#define HYPERMAP_STORAGE_LIBPQ_PIPELINE_H_

#include <cstddef>
#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/parameters.h"
#include "storage/libpq/rows.h"

namespace hypermap::storage::postgres {

class Connection;
class Exchange;
class Session;

// Sends statements without waiting for the answer to each (libpq's pipeline mode). After the first
// statement that fails the rest are skipped, and the transaction that they are part of is rolled
// back; so it is if a statement can't be sent because a text in it is invalid, or if the work of
// this thread is cancelled before a COMMIT is added. Without BEGIN, and outside of a transaction,
// the statements are one transaction. REQUIRES: until Finish has returned nothing else uses the
// connection.
//
//   Pipeline pipeline(connection);
//   pipeline.Add("BEGIN");
//   pipeline.Add("UPDATE …", values…);
//   pipeline.Add("COMMIT");
//   HYPERMAP_RETURN_IF_ERROR(pipeline.Finish());
class Pipeline {
 public:
  explicit Pipeline(Connection* connection);
  // If Finish was not called: rolls the transaction back, unless COMMIT was added, and waits for
  // it.
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  // Sends a statement, or keeps it until there is room. Sending never waits for an answer that the
  // database can't send because it waits itself. At most some 64 KB are kept besides the statement.
  // An error is returned by Finish.
  template <typename... Values>
  void Add(const std::string& sql, const Values&... values) {
    Send(sql, Parameters(values...));
  }
  void Send(const std::string& sql, const Parameters& parameters);
  // As Add, and keeps the rows of the answer. REQUIRES: they are few.
  template <typename... Values>
  void Ask(const std::string& sql, const Values&... values) {
    is_asked_ = true;
    Send(sql, Parameters(values...));
    is_asked_ = false;
  }

  // The database sends the answers up to here when it has them, and not with the last one.
  void Flush();
  // Waits for the answer to the next Ask whose rows were not returned yet, while the database works
  // at later ones. Nothing can be added any more. An error is that of Finish, which was called.
  absl::StatusOr<Rows> NextRows();

  // Waits for all answers: OK, or the error of the first statement that failed. If the connection
  // broke, is_broken() is true and it is not known whether a COMMIT among them was carried out.
  absl::Status Finish();
  // After Finish has returned OK: the rows of each Ask, in order, without those that NextRows has
  // returned.
  std::deque<Rows> TakeRows() { return std::move(rows_); }

 private:
  // What was sent and not answered yet.
  struct Command {
    std::string prepares;  // the text of the statement that it prepares, if any
    bool is_commit = false;
    bool is_asked = false;  // its rows are kept
  };

  Session& session();
  absl::Status Queue(const std::string& sql, const Parameters& parameters);
  absl::Status SendIfFull(size_t more_bytes);
  absl::Status SendEnd();
  absl::Status Complete();
  absl::Status ReadResults();
  absl::Status Close(absl::Status status);

  Connection* const connection_;
  std::unique_ptr<Exchange> exchange_;  // null if the pipeline could not be opened, or is finished
  std::deque<Command> unanswered_;
  std::deque<Rows> rows_;
  size_t kept_bytes_ = 0;
  bool is_asked_ = false;  // within Ask
  bool is_ended_ = false;  // SendEnd was called
  bool in_transaction_;    // after what was added
  absl::Status unsent_;    // why statements were not sent
  absl::Status failure_;   // the first error of the database
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_PIPELINE_H_
