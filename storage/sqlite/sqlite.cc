#include "storage/sqlite/sqlite.h"

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/sqlite/paced_writes.h"
#include "storage/sqlite/page_checksums.h"

namespace hypermap::storage {
namespace {

absl::StatusCode CodeOf(int sqlite_code) {
  switch (sqlite_code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_PROTOCOL:  // no lock of the log could be taken for ten seconds
    case SQLITE_IOERR:
      return absl::StatusCode::kUnavailable;
    case SQLITE_FULL:
    case SQLITE_TOOBIG:
    case SQLITE_NOMEM:
      return absl::StatusCode::kResourceExhausted;
    case SQLITE_CORRUPT:
      return absl::StatusCode::kDataLoss;
    case SQLITE_NOTADB:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return absl::StatusCode::kFailedPrecondition;
    default:
      return absl::StatusCode::kInternal;
  }
}

const char* TypeName(int type) {
  switch (type) {
    case SQLITE_INTEGER:
      return "an integer";
    case SQLITE_FLOAT:
      return "a number";
    case SQLITE_TEXT:
      return "text";
    case SQLITE_BLOB:
      return "a blob";
    default:
      return "NULL";
  }
}

// The name by which SQLite opens a file without its write-ahead log
// (https://www.sqlite.org/uri.html#uriimmutable).
std::string ImmutableUri(absl::string_view path) {
  std::string uri = absl::StartsWith(path, "/") ? "file://" : "file:";
  for (const char c : path) {
    if (absl::ascii_isalnum(static_cast<unsigned char>(c)) || absl::StrContains("/-_.", c)) {
      uri.push_back(c);
    } else {
      absl::StrAppend(&uri, "%", absl::Hex(static_cast<unsigned char>(c), absl::kZeroPad2));
    }
  }
  return absl::StrCat(uri, "?immutable=1");
}

// Makes the settings that hold for the whole process.
bool ConfigureSqlite() {
  // With memory statistics, SQLite takes a global lock for each allocation of every connection. The
  // call fails without harm if the process already uses SQLite.
  const bool counts_no_memory = sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0) == SQLITE_OK;
  PaceWritesOfSqlite();
  return counts_no_memory;
}

}  // namespace

Statement::Statement(Database* database, std::string sql, sqlite3_stmt* stmt)
    : database_(database), sql_(std::move(sql)), stmt_(stmt) {}

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_),
      sql_(std::move(other.sql_)),
      stmt_(std::exchange(other.stmt_, nullptr)),
      bind_error_(other.bind_error_),
      row_status_(std::move(other.row_status_)) {}

Statement::~Statement() {
  if (stmt_ == nullptr) return;
  Reset();
  database_->Return(std::move(sql_), stmt_);
}

absl::StatusOr<bool> Statement::Step() {
  if (bind_error_ != SQLITE_OK) return database_->ErrorStatus(bind_error_);
  row_status_ = absl::OkStatus();
  const int code = sqlite3_step(stmt_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  const absl::Status status = database_->ErrorStatus(code);
  sqlite3_reset(stmt_);
  return status;
}

absl::Status Statement::Run() {
  absl::StatusOr<bool> row = Step();
  while (row.ok() && *row) row = Step();
  Reset();
  return row.status();
}

void Statement::Reset() {
  sqlite3_reset(stmt_);
  sqlite3_clear_bindings(stmt_);
  bind_error_ = SQLITE_OK;
}

bool Statement::IsNull(int column) const {
  return sqlite3_column_type(stmt_, column) == SQLITE_NULL;
}

bool Statement::Expect(int column, int type) {
  const int found = sqlite3_column_type(stmt_, column);
  if (found == type) return true;
  if (row_status_.ok()) {
    row_status_ =
        absl::DataLossError(absl::StrCat("column ", sqlite3_column_name(stmt_, column), " holds ",
                                         TypeName(found), ", not ", TypeName(type)));
  }
  return false;
}

int64_t Statement::Int64(int column) {
  return Expect(column, SQLITE_INTEGER) ? sqlite3_column_int64(stmt_, column) : 0;
}

double Statement::Double(int column) {
  // A whole number in a column without affinity to REAL is kept as an integer.
  if (sqlite3_column_type(stmt_, column) == SQLITE_INTEGER) {
    return sqlite3_column_double(stmt_, column);
  }
  return Expect(column, SQLITE_FLOAT) ? sqlite3_column_double(stmt_, column) : 0.0;
}

absl::string_view Statement::Text(int column) {
  if (!Expect(column, SQLITE_TEXT)) return {};
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(stmt_, column));
  return {text, static_cast<size_t>(sqlite3_column_bytes(stmt_, column))};
}

absl::string_view Statement::Blob(int column) {
  if (!Expect(column, SQLITE_BLOB)) return {};
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(stmt_, column));
  return {bytes, static_cast<size_t>(sqlite3_column_bytes(stmt_, column))};
}

std::optional<int64_t> Statement::OptionalInt64(int column) {
  if (IsNull(column)) return std::nullopt;
  return Int64(column);
}

std::optional<double> Statement::OptionalDouble(int column) {
  if (IsNull(column)) return std::nullopt;
  return Double(column);
}

void Statement::BindOne(int index, int64_t value) {
  KeepBindError(sqlite3_bind_int64(stmt_, index, value));
}

void Statement::BindOne(int index, double value) {
  KeepBindError(sqlite3_bind_double(stmt_, index, value));
}

void Statement::BindOne(int index, absl::string_view text) {
  // A null pointer would bind NULL where the caller means the empty string.
  KeepBindError(sqlite3_bind_text64(stmt_, index, text.empty() ? "" : text.data(), text.size(),
                                    SQLITE_STATIC, SQLITE_UTF8));
}

void Statement::BindOne(int index, const BlobView& blob) {
  KeepBindError(sqlite3_bind_blob64(stmt_, index, blob.bytes.empty() ? "" : blob.bytes.data(),
                                    blob.bytes.size(), SQLITE_STATIC));
}

void Statement::KeepBindError(int code) {
  if (bind_error_ == SQLITE_OK) bind_error_ = code;
}

Database::Database(std::string path, sqlite3* handle) : path_(std::move(path)), handle_(handle) {}

Database::~Database() {
  ForgetStatements();
  sqlite3_close_v2(handle_);
}

absl::StatusOr<std::unique_ptr<Database>> Database::Open(const std::string& path, OpenMode mode,
                                                         absl::Duration busy_timeout) {
  static const bool is_configured = ConfigureSqlite();
  static_cast<void>(is_configured);
  sqlite3* handle = nullptr;
  const bool file_alone = mode == OpenMode::kFileAlone;
  const bool read_only = file_alone || mode == OpenMode::kReadOnly;
  const int flags =
      SQLITE_OPEN_NOMUTEX | (read_only ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE) |
      (file_alone ? SQLITE_OPEN_URI : 0) | (mode == OpenMode::kCreate ? SQLITE_OPEN_CREATE : 0);
  const std::string name = file_alone ? ImmutableUri(path) : path;
  const int code = sqlite3_open_v2(name.c_str(), &handle, flags, ChecksumVfs());
  std::unique_ptr<Database> database(new Database(path, handle));
  if (code != SQLITE_OK) return database->ErrorStatus(code);
  sqlite3_extended_result_codes(handle, 1);
  KeepChecksums(handle);
  sqlite3_busy_timeout(handle, static_cast<int>(absl::ToInt64Milliseconds(busy_timeout)));
  // A file may come from another program. Its triggers must be allowed to write to R*Trees, which
  // SQLite otherwise treats as unsafe, but not to their shadow tables.
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_FKEY, 1, nullptr);
  // Otherwise a reader that is closed last would remove the log, which may belong to another file
  // of that name by then.
  if (read_only) {
    sqlite3_db_config(handle, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  }
  return database;
}

absl::Status Database::Execute(const std::string& sql) {
  const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? absl::OkStatus() : ErrorStatus(code);
}

absl::StatusOr<Statement> Database::Prepare(const std::string& sql) {
  // A loop repeats the statements that were used last, which are found first.
  const auto idle = std::find_if(idle_.rbegin(), idle_.rend(),
                                 [&sql](const IdleStatement& s) { return s.sql == sql; });
  if (idle != idle_.rend()) {
    Statement statement(this, std::move(idle->sql), idle->stmt);
    idle_.erase(std::prev(idle.base()));
    return statement;
  }
  sqlite3_stmt* stmt = nullptr;
  const int code = sqlite3_prepare_v3(handle_, sql.c_str(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &stmt, nullptr);
  if (code != SQLITE_OK) return ErrorStatus(code);
  return Statement(this, sql, stmt);
}

void Database::Return(std::string sql, sqlite3_stmt* stmt) {
  if (idle_.size() == kMaxIdleStatements) {
    sqlite3_finalize(idle_.front().stmt);
    idle_.erase(idle_.begin());
  }
  idle_.push_back({std::move(sql), stmt});
}

absl::StatusOr<std::optional<int64_t>> Database::FirstInt64(Statement* statement) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, statement->Step());
  if (!has_row) return std::nullopt;
  const std::optional<int64_t> value = statement->OptionalInt64(0);
  HYPERMAP_RETURN_IF_ERROR(statement->row_status());
  return value;
}

int64_t Database::changed_rows() const { return sqlite3_changes64(handle_); }

void Database::ForgetStatements() {
  for (const IdleStatement& idle : idle_) sqlite3_finalize(idle.stmt);
  idle_.clear();
}

absl::Status Database::ErrorStatus(int code) const {
  if (code == SQLITE_IOERR_DATA) return absl::DataLossError(DescribeFailedPage(LastFailedPage()));
  // The connection's own message says more, but only when it is about this error.
  const bool is_last =
      handle_ != nullptr && (sqlite3_extended_errcode(handle_) & 0xff) == (code & 0xff);
  const char* message = is_last ? sqlite3_errmsg(handle_) : sqlite3_errstr(code);
  int system_error = is_last ? sqlite3_system_errno(handle_) : 0;
  const bool is_of_folder = code == SQLITE_IOERR_DIR_FSYNC;
  if (is_of_folder) system_error = LastFolderError();
  if (((code & 0xff) == SQLITE_CANTOPEN || is_of_folder) &&
      (system_error == EMFILE || system_error == ENFILE)) {
    return absl::ResourceExhaustedError(absl::StrCat(
        message, ": the limit of open files (ulimit -n) is reached (SQLite ", code, ")"));
  }
  return absl::Status(CodeOf(code), absl::StrCat(message, " (SQLite ", code, ")"));
}

absl::StatusOr<Transaction> Transaction::Begin(Database* database) {
  HYPERMAP_RETURN_IF_ERROR(database->Run("BEGIN IMMEDIATE"));
  return Transaction(database);
}

Transaction::Transaction(Transaction&& other) noexcept
    : database_(std::exchange(other.database_, nullptr)) {}

Transaction::~Transaction() {
  if (database_ == nullptr) return;
  // Some errors have rolled back already; then there is nothing left to undo.
  if (sqlite3_get_autocommit(database_->handle()) == 0) {
    sqlite3_exec(database_->handle(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

absl::Status Transaction::Commit() {
  HYPERMAP_RETURN_IF_ERROR(database_->Run("COMMIT"));
  database_ = nullptr;
  SqliteHasSynced();
  return absl::OkStatus();
}

absl::StatusOr<ReadTransaction> ReadTransaction::Begin(Database* database) {
  if (sqlite3_get_autocommit(database->handle()) == 0) return ReadTransaction(nullptr);
  HYPERMAP_RETURN_IF_ERROR(database->Run("BEGIN"));
  return ReadTransaction(database);
}

ReadTransaction::ReadTransaction(ReadTransaction&& other) noexcept
    : database_(std::exchange(other.database_, nullptr)) {}

ReadTransaction::~ReadTransaction() {
  if (database_ == nullptr) return;
  sqlite3_exec(database_->handle(), "COMMIT", nullptr, nullptr, nullptr);
}

}  // namespace hypermap::storage
