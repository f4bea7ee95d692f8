// SQLite with owners, typed columns and absl::Status.
//
// A Database is one connection and belongs to one thread at a time. Statements are borrowed from it
// and must not outlive it. Everything read is taken to be untrusted: a column of another type than
// asked for is an error, never a silent conversion.
//
// Codes become: BUSY, LOCKED, IOERR -> UNAVAILABLE; FULL, TOOBIG, NOMEM -> RESOURCE_EXHAUSTED;
// CORRUPT -> DATA_LOSS; NOTADB, CANTOPEN, READONLY, PERM -> FAILED_PRECONDITION; the rest, which
// are ours to prevent, -> INTERNAL.
#ifndef HYPERMAP_STORAGE_SQLITE_SQLITE_H_
#define HYPERMAP_STORAGE_SQLITE_SQLITE_H_

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace hypermap::storage {

class Database;

// Bytes to be bound as a BLOB rather than as text. Does not own them.
struct BlobView {
  absl::string_view bytes;
};

// A prepared statement on loan from its database's cache, to which it goes back reset. Movable.
class Statement {
 public:
  // The prepared statements of one text.
  struct Shelf {
    std::vector<sqlite3_stmt*> idle;
    int num_lent = 0;
  };

  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&&) = delete;
  ~Statement();

  // Binds parameters 1, 2, ... in order. What is bound must live until the next Reset or the end.
  template <typename... Values>
  Statement& Bind(const Values&... values) {
    int index = 0;
    (BindOne(++index, values), ...);
    return *this;
  }

  // True when there is a row to read, false at the end.
  absl::StatusOr<bool> Step();
  // Runs a statement that gives no rows, and resets it to be bound and run again.
  absl::Status Run();
  void Reset();

  // Columns of the current row, 0-based; views are valid until the next Step. A NULL or a column of
  // another type gives a default and is told by row_status, so that a row is read first and checked
  // once.
  bool IsNull(int column) const;
  int64_t Int64(int column);
  double Double(int column);
  absl::string_view Text(int column);
  absl::string_view Blob(int column);
  std::optional<int64_t> OptionalInt64(int column);
  std::optional<double> OptionalDouble(int column);
  // DATA_LOSS naming the first column of this row that was read as what it is not.
  const absl::Status& row_status() const { return row_status_; }

 private:
  friend class Database;
  Statement(Database* database, Shelf* shelf, sqlite3_stmt* stmt);

  void BindOne(int index, int value) { BindOne(index, int64_t{value}); }
  void BindOne(int index, int64_t value);
  void BindOne(int index, double value);
  void BindOne(int index, const char* text) { BindOne(index, absl::string_view(text)); }
  void BindOne(int index, const std::string& text) { BindOne(index, absl::string_view(text)); }
  void BindOne(int index, absl::string_view text);
  void BindOne(int index, const BlobView& blob);
  template <typename T>
  void BindOne(int index, const std::optional<T>& value) {
    if (value) BindOne(index, *value);  // else it stays NULL
  }
  void KeepBindError(int code);
  bool Expect(int column, int type);

  Database* database_;
  Shelf* shelf_;  // where it goes back to
  sqlite3_stmt* stmt_;
  int bind_error_ = SQLITE_OK;
  absl::Status row_status_;
};

class Database {
 public:
  enum class OpenMode {
    kExisting,  // a file that is there
    kCreate,    // a file that is made when missing
    kReadOnly,  // a file that is there; neither it nor its log is ever changed
  };
  // Opens a file. Nothing is read yet, so a file that is no database is
  // found by the first statement.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path, OpenMode mode,
                                                        absl::Duration busy_timeout);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  const std::string& path() const { return path_; }
  sqlite3* handle() { return handle_; }

  // Runs a script of statements without parameters.
  absl::Status Execute(const std::string& sql);

  absl::StatusOr<Statement> Prepare(const std::string& sql);

  // Prepares, binds and runs a statement that gives no rows.
  template <typename... Values>
  absl::Status Run(const std::string& sql, const Values&... values) {
    absl::StatusOr<Statement> statement = Prepare(sql);
    if (!statement.ok()) return statement.status();
    return statement->Bind(values...).Run();
  }

  // The first column of the first row; nullopt when there is no row or it is NULL.
  template <typename... Values>
  absl::StatusOr<std::optional<int64_t>> QueryInt64(const std::string& sql,
                                                    const Values&... values) {
    absl::StatusOr<Statement> statement = Prepare(sql);
    if (!statement.ok()) return statement.status();
    return FirstInt64(&statement->Bind(values...));
  }

  // Rows that the last INSERT, UPDATE or DELETE changed itself.
  int64_t changed_rows() const;

  // Frees all prepared statements that are not on loan.
  void ForgetStatements();

 private:
  friend class Statement;
  Database(std::string path, sqlite3* handle);

  static absl::StatusOr<std::optional<int64_t>> FirstInt64(Statement* statement);
  absl::Status ErrorStatus(int code) const;

  std::string path_;
  sqlite3* handle_;
  std::unordered_map<std::string, Statement::Shelf> statements_;  // by their text
};

// A write transaction; rolled back unless committed.
class Transaction {
 public:
  // Takes the write lock, waiting for it as long as the database's busy timeout.
  static absl::StatusOr<Transaction> Begin(Database* database);
  Transaction(Transaction&& other) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();

  absl::Status Commit();

 private:
  explicit Transaction(Database* database) : database_(database) {}
  Database* database_;  // null when over
};

// What is read while this lives is of one moment, beginning with the first read. Where the database
// is in a transaction already, that one goes on.
class ReadTransaction {
 public:
  static absl::StatusOr<ReadTransaction> Begin(Database* database);
  ReadTransaction(ReadTransaction&& other) noexcept;
  ReadTransaction& operator=(ReadTransaction&&) = delete;
  ~ReadTransaction();

 private:
  explicit ReadTransaction(Database* database) : database_(database) {}
  Database* database_;  // null when it is another's transaction
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_SQLITE_H_
