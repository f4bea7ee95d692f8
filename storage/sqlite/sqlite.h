// A C++ interface to SQLite with ownership, typed columns and absl::Status.
//
// A Database is one connection and is used by one thread at a time. Statements are borrowed from it
// and must not outlive it. Content is not trusted: a column of another type than asked for is an
// error, never a silent conversion.
//
// Files that a Database creates, also by VACUUM INTO, keep checksums of their pages, which are
// verified when a page is read (page_checksums.h).
//
// Result codes are mapped as follows: BUSY, LOCKED, PROTOCOL, IOERR -> UNAVAILABLE; FULL, TOOBIG,
// NOMEM -> RESOURCE_EXHAUSTED; CORRUPT, IOERR_DATA -> DATA_LOSS; NOTADB, CANTOPEN, READONLY, PERM
// -> FAILED_PRECONDITION, but RESOURCE_EXHAUSTED if the process may open no more files; the rest,
// which are faults of the program, -> INTERNAL.
#ifndef HYPERMAP_STORAGE_SQLITE_SQLITE_H_
#define HYPERMAP_STORAGE_SQLITE_SQLITE_H_

#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {

class Database;

// Bytes that are bound as a BLOB instead of as text. Does not own them.
struct BlobView {
  absl::string_view bytes;
};

// A prepared statement, borrowed from the cache of its database; returns there, reset, when
// destroyed. Movable.
class Statement {
 public:
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&&) = delete;
  ~Statement();

  // Binds parameters 1, 2, ... in order. Bound text and blobs must live until the next Reset or
  // until the statement is destroyed.
  template <typename... Values>
  Statement& Bind(const Values&... values) {
    int index = 0;
    (BindOne(++index, values), ...);
    return *this;
  }

  // Advances to the next row; false when there is none.
  absl::StatusOr<bool> Step();
  // Runs a statement to its end, ignoring its rows, and resets it, so that it can be bound and run
  // again.
  absl::Status Run();
  void Reset();

  // Columns of the current row, counted from 0; views are valid until the next Step. A NULL or a
  // column of another type gives a default value and sets row_status, so that a row can be read as
  // a whole and checked once.
  bool IsNull(int column) const;
  int64_t Int64(int column);
  double Double(int column);
  absl::string_view Text(int column);
  absl::string_view Blob(int column);
  std::optional<int64_t> OptionalInt64(int column);
  std::optional<double> OptionalDouble(int column);
  // DATA_LOSS naming the first column of this row that was read as another type than it has.
  const absl::Status& row_status() const { return row_status_; }

 private:
  friend class Database;
  Statement(Database* database, std::string sql, sqlite3_stmt* stmt);

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
  std::string sql_;
  sqlite3_stmt* stmt_;  // null when moved from
  int bind_error_ = SQLITE_OK;
  absl::Status row_status_;
};

class Database {
 public:
  // Number of statements that are kept prepared while they are not in use. A statement takes 2 to
  // 11 KB, and one of a dropped R*Tree 20 KB, because it keeps the tree's own statements. A commit
  // uses about 20, and 3 more for each layer that it changes.
  static constexpr size_t kMaxIdleStatements = 64;

  enum class OpenMode {
    kExisting,   // the file must exist
    kCreate,     // the file is created when it does not exist
    kReadOnly,   // the file must exist; neither it nor its log is ever changed
    kFileAlone,  // as kReadOnly, but reads the file without its log; no one may write it meanwhile
  };
  // Opens a file. Nothing is read yet: the first statement fails when the file is not a database.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path, OpenMode mode,
                                                        absl::Duration busy_timeout);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  const std::string& path() const { return path_; }
  sqlite3* handle() { return handle_; }

  // Runs a script of statements without parameters.
  absl::Status Execute(const std::string& sql);

  // Borrows a statement of this text from the cache, or prepares it. When more than
  // kMaxIdleStatements have been returned, the one that was not used for longest is freed.
  absl::StatusOr<Statement> Prepare(const std::string& sql);

  // Prepares, binds and runs a statement, ignoring its rows.
  template <typename... Values>
  absl::Status Run(const std::string& sql, const Values&... values) {
    HYPERMAP_ASSIGN_OR_RETURN(Statement statement, Prepare(sql));
    return statement.Bind(values...).Run();
  }

  // The first column of the first row; nullopt when there is no row or it is NULL. The statement
  // must not write outside of a transaction: it would be committed after the row, and an error of
  // that commit would be lost.
  template <typename... Values>
  absl::StatusOr<std::optional<int64_t>> QueryInt64(const std::string& sql,
                                                    const Values&... values) {
    HYPERMAP_ASSIGN_OR_RETURN(Statement statement, Prepare(sql));
    return FirstInt64(&statement.Bind(values...));
  }

  // Number of rows that the last INSERT, UPDATE or DELETE changed, without those changed by
  // triggers.
  int64_t changed_rows() const;

  // Frees all prepared statements that are not in use.
  void ForgetStatements();

 private:
  friend class Statement;
  Database(std::string path, sqlite3* handle);

  // A statement that nobody has borrowed.
  struct IdleStatement {
    std::string sql;
    sqlite3_stmt* stmt;
  };

  // Takes a statement back.
  void Return(std::string sql, sqlite3_stmt* stmt);

  static absl::StatusOr<std::optional<int64_t>> FirstInt64(Statement* statement);
  absl::Status ErrorStatus(int code) const;

  std::string path_;
  sqlite3* handle_;
  std::vector<IdleStatement> idle_;  // the one that was used last at the end
};

// A write transaction; rolled back unless committed.
class Transaction {
 public:
  // Takes the write lock; waits for it up to the database's busy timeout.
  static absl::StatusOr<Transaction> Begin(Database* database);
  Transaction(Transaction&& other) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();

  absl::Status Commit();

 private:
  explicit Transaction(Database* database) : database_(database) {}
  Database* database_;  // null when committed or moved from
};

// All reads while this lives see the state at the time of the first of them. When the database is
// in a transaction already, the reads are part of that one.
class ReadTransaction {
 public:
  static absl::StatusOr<ReadTransaction> Begin(Database* database);
  ReadTransaction(ReadTransaction&& other) noexcept;
  ReadTransaction& operator=(ReadTransaction&&) = delete;
  ~ReadTransaction();

 private:
  explicit ReadTransaction(Database* database) : database_(database) {}
  Database* database_;  // null when the transaction is another's
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_SQLITE_H_
