// Loading of many rows.
#ifndef HYPERMAP_STORAGE_LIBPQ_COPY_IN_H_
#define HYPERMAP_STORAGE_LIBPQ_COPY_IN_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/parameters.h"

namespace hypermap::storage::postgres {

class Connection;
class Exchange;
class Session;

// Loads rows by COPY … FROM STDIN (FORMAT binary). REQUIRES: until Finish has returned, or this is
// destroyed, nothing else uses the connection.
//
//   HYPERMAP_ASSIGN_OR_RETURN(auto copy, CopyIn::Begin(
//       connection, "COPY hypermap.revisions (map, revision) FROM STDIN (FORMAT binary)"));
//   HYPERMAP_RETURN_IF_ERROR(copy->AddRow(map, revision));
//   HYPERMAP_RETURN_IF_ERROR(copy->Finish());
class CopyIn {
 public:
  // `sql` is the COPY statement.
  static absl::StatusOr<std::unique_ptr<CopyIn>> Begin(Connection* connection,
                                                       const std::string& sql);
  // Gives the copy up, if Finish was not called: none of its rows is stored.
  ~CopyIn();
  CopyIn(const CopyIn&) = delete;
  CopyIn& operator=(const CopyIn&) = delete;

  // The values must have exactly the types of the columns. Rows are sent some 64 KB at a time. An
  // error is final. Errors of the database, also those of a row, are returned by Finish.
  template <typename... Values>
  absl::Status AddRow(const Values&... values) {
    return Send(Parameters(values...));
  }
  absl::Status Send(const Parameters& row);
  // OK if all rows are stored; on error none is.
  absl::Status Finish();

 private:
  CopyIn(Connection* connection, std::unique_ptr<Exchange> exchange);
  Session& session();
  absl::Status SendBuffer();
  // Ends the copy, with an error if there is a message.
  absl::Status End(const char* message);

  Connection* const connection_;
  std::unique_ptr<Exchange> exchange_;  // null once ended
  std::string buffer_;
  absl::Status status_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_COPY_IN_H_
