#include "storage/geopackage/foreign_writes.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <system_error>

#include "base/status/status_macros.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/map_file.h"
#include "storage/geopackage/schema.h"
#include "storage/sqlite/page_checksums.h"

namespace hypermap::storage {
namespace {

// Each event needs a trigger of its own.
constexpr char kWatchTable[] = R"sql(
CREATE TRIGGER "hypermap_$t_insert" AFTER INSERT ON "$t"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_$t_update" AFTER UPDATE ON "$t"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
CREATE TRIGGER "hypermap_$t_delete" AFTER DELETE ON "$t"
  WHEN (SELECT writing FROM hypermap_metadata WHERE id = 1) = 0
BEGIN
  UPDATE hypermap_metadata SET foreign_writes = 1 WHERE id = 1;
END;
)sql";

constexpr char kRecordSchema[] = R"sql(
UPDATE hypermap_metadata SET schema_cookie = (SELECT schema_version FROM pragma_schema_version)
  WHERE id = 1
)sql";

constexpr char kReadSigns[] = R"sql(
SELECT foreign_writes = 1 OR schema_cookie != (SELECT schema_version FROM pragma_schema_version),
       write_ahead
  FROM hypermap_metadata WHERE id = 1
)sql";

sqlite3_file* FileOf(Database* database) {
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database->handle(), "main", SQLITE_FCNTL_FILE_POINTER, &file);
  return file;
}

// Returns whether the header says that the file has write-ahead logging. SQLite itself does not
// tell it of a file that it reads alone.
bool HasWriteAhead(Database* database) {
  constexpr int kWriteVersionAt = 18;  // https://www.sqlite.org/fileformat2.html, section 1.3.4
  constexpr char kWriteAheadLog = 2;
  char header[kWriteVersionAt + 1] = {};
  sqlite3_file* const file = FileOf(database);
  return file->pMethods->xRead(file, header, sizeof(header), 0) != SQLITE_OK ||
         header[kWriteVersionAt] == kWriteAheadLog;
}

// DATA_LOSS if the last page is incomplete.
absl::Status CheckIsWhole(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> page_size,
                            database->QueryInt64("PRAGMA page_size"));
  sqlite3_file* const file = FileOf(database);
  sqlite3_int64 size = 0;
  if (file->pMethods->xFileSize(file, &size) != SQLITE_OK) {
    return absl::UnavailableError("the size of the file can't be read");
  }
  if (size % page_size.value_or(1) == 0) return absl::OkStatus();
  return absl::DataLossError("the file is cut short");
}

// Values of hypermap_metadata.write_ahead.
constexpr int64_t kNoLog = 0;
constexpr int64_t kLogIsClosed = 1;
constexpr int64_t kLogIsOpen = 2;

absl::Status SetWriteAhead(Database* database, int64_t state) {
  return database->Run("UPDATE hypermap_metadata SET write_ahead = ? WHERE id = 1", state);
}

// Returns whether a log with content is beside the file.
bool HasLog(const std::string& path) {
  std::error_code error;
  const uintmax_t size = std::filesystem::file_size(LogPathOf(path), error);
  return !error && size > 0;
}

// Returns whether the file tells that it was written. An error if it does not tell. `had_log`: a
// log was beside the file before it was opened.
absl::StatusOr<bool> ReadSigns(Database* database, bool had_log) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database->Prepare(kReadSigns));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
  if (!has_row) return absl::DataLossError("hypermap_metadata has no row");
  const bool is_written = select.Int64(0) != 0;
  const int64_t write_ahead = select.Int64(1);
  HYPERMAP_RETURN_IF_ERROR(select.row_status());
  return is_written || (write_ahead != kNoLog && !HasWriteAhead(database)) ||
         (write_ahead == kLogIsOpen && !had_log);
}

// Returns the number of pages that got new checksums.
absl::StatusOr<int64_t> Adopt(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_whole, MoveLogIntoFile(database));
  if (!is_whole) return absl::UnavailableError("another program has the file open");
  HYPERMAP_RETURN_IF_ERROR(CheckIsWhole(database));
  HYPERMAP_RETURN_IF_ERROR(CheckIntegrity(database));
  // Nobody else can write while the transaction lasts.
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database));
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t num_adopted, AdoptPages(database->handle()));
  HYPERMAP_RETURN_IF_ERROR(
      database->Run("UPDATE hypermap_metadata SET foreign_writes = 0 WHERE id = 1"));
  HYPERMAP_RETURN_IF_ERROR(RecordCopy(database));
  HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  return num_adopted;
}

}  // namespace

const char kAddForeignWrites[] = R"sql(
ALTER TABLE hypermap_metadata ADD COLUMN writing INTEGER NOT NULL DEFAULT 0;
ALTER TABLE hypermap_metadata ADD COLUMN foreign_writes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE hypermap_metadata ADD COLUMN schema_cookie INTEGER NOT NULL DEFAULT 0;
ALTER TABLE hypermap_metadata ADD COLUMN write_ahead INTEGER NOT NULL DEFAULT 0;
)sql";

absl::Status WatchForForeignWrites(Database* database, const std::string& table) {
  return database->Execute(ForTable(kWatchTable, table));
}

absl::Status BeginOwnWrites(Database* database) {
  return database->Run("UPDATE hypermap_metadata SET writing = 1, write_ahead = ? WHERE id = 1",
                       kLogIsOpen);
}

absl::Status RecordSchema(Database* database) { return database->Run(kRecordSchema); }

absl::Status RecordOpening(Database* database) {
  const absl::Status status = SetWriteAhead(database, kLogIsOpen);
  return absl::IsResourceExhausted(status) ? absl::OkStatus() : status;
}

absl::Status RecordClosing(Database* database) { return SetWriteAhead(database, kLogIsClosed); }

absl::Status RecordCopy(Database* database) {
  HYPERMAP_RETURN_IF_ERROR(SetWriteAhead(database, kNoLog));
  return RecordSchema(database);
}

bool WasWrittenByOthers(const std::string& path) {
  const bool had_log = HasLog(path);
  const auto database =
      Database::Open(path, ModeForReading(path), GeoPackageOptions().busy_timeout);
  if (!database.ok()) return false;
  const UnverifiedReads here((*database)->handle());
  const absl::StatusOr<bool> is_written = ReadSigns(database->get(), had_log);
  return is_written.ok() && *is_written;
}

absl::StatusOr<bool> AdoptForeignWrites(const std::string& path, const GeoPackageOptions& options) {
  const bool had_log = HasLog(path);
  const auto opened = Database::Open(path, Database::OpenMode::kExisting, options.busy_timeout);
  if (!opened.ok()) return false;
  Database* const database = opened->get();
  // A log stays as it is, for the connection that opens the file after this one.
  if (had_log) sqlite3_db_config(database->handle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  const UnverifiedReads here(database->handle());
  const absl::StatusOr<int64_t> version = ReadSchemaVersion(database);
  if (version.ok()) HYPERMAP_RETURN_IF_ERROR(CheckIsNotNewer(*version, kSchemaVersion));
  const absl::StatusOr<bool> is_written = ReadSigns(database, had_log);
  // Whatever else is wrong with the file is found when it is opened as a map.
  if (!is_written.ok() || !*is_written || !KeepsChecksums(database->handle())) return false;
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t num_adopted, Adopt(database));
  return num_adopted > 0;
}

}  // namespace hypermap::storage
