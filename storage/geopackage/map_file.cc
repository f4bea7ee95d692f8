#include "storage/geopackage/map_file.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/damaged_pages.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/schema.h"
#include "storage/geopackage/spatial_functions.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/page_checksums.h"

namespace hypermap::storage {
namespace {

// Pages that an error names at most.
constexpr int kMaxDamagedPages = 20;

constexpr char kSettings[] = R"sql(
PRAGMA synchronous = FULL;
PRAGMA temp_store = MEMORY;
PRAGMA cache_size = -16384;
PRAGMA journal_size_limit = 67108864;
)sql";

// The size of the file; FAILED_PRECONDITION if it can't be a map. Does not open the file, because
// closing it would release the POSIX locks that SQLite holds on it in this process.
absl::StatusOr<int64_t> SizeOfFile(const std::string& path) {
  struct stat status;
  if (stat(path.c_str(), &status) != 0) return FileError(errno, path);
  if (!S_ISREG(status.st_mode)) return absl::FailedPreconditionError("not a regular file");
  if (status.st_size == 0) return absl::FailedPreconditionError("the file is empty");
  return status.st_size;
}

// DATA_LOSS if the last page is incomplete, which SQLite would read as zeros. After a crash this is
// allowed if there is a write-ahead log, which then contains the page.
absl::Status CheckLength(Database* database, int64_t size, bool has_log) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> page_size,
                            database->QueryInt64("PRAGMA page_size"));
  if (has_log || size % *page_size == 0) return absl::OkStatus();
  return absl::DataLossError("the file is cut short");
}

// `pragma` is one of SQLite's checks that answer "ok" or with the first problem. UNAVAILABLE if the
// file could not be read. `failed` gets the pages that fail their checksums.
absl::Status RunCheck(Database* database, const std::string& pragma,
                      std::set<int64_t>* failed_pages = nullptr) {
  const FailedPages failed;
  HYPERMAP_ASSIGN_OR_RETURN(Statement check, database->Prepare(pragma));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, check.Step());
  const std::string result(has_row ? check.Text(0) : "no answer");
  if (result == "ok") return absl::OkStatus();
  if (!failed.numbers().empty()) {
    if (failed_pages != nullptr) *failed_pages = failed.numbers();
    return absl::DataLossError(DescribeFailedPage(*failed.numbers().begin()));
  }
  return IsReadError(result) ? absl::UnavailableError(result) : absl::DataLossError(result);
}

absl::Status WriteAhead(Database* database) {
  HYPERMAP_RETURN_IF_ERROR(database->Execute(kSettings));
  HYPERMAP_ASSIGN_OR_RETURN(Statement set, database->Prepare("PRAGMA journal_mode = WAL"));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, set.Step());
  // The change of the mode is written after the row that tells it.
  if (has_row && set.Text(0) == "wal") return set.Run();
  return absl::FailedPreconditionError("the file system does not allow write-ahead logging");
}

absl::Status LimitSize(Database* database, int64_t max_bytes) {
  if (max_bytes <= 0) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> page_size,
                            database->QueryInt64("PRAGMA page_size"));
  return database->Execute(
      absl::StrCat("PRAGMA max_page_count = ", std::max<int64_t>(1, max_bytes / *page_size)));
}

// OK if all pages are as they were written; DATA_LOSS in `damage` if some fail their checksums.
absl::Status CheckPages(Database* database, absl::Status* damage) {
  std::set<int64_t> failed;
  // After the first failing page the check goes on, up to so many problems.
  const absl::Status status =
      RunCheck(database, absl::StrCat("PRAGMA quick_check(", kMaxDamagedPages, ")"), &failed);
  if (failed.empty()) return status;
  *damage = absl::DataLossError(absl::StrJoin(DescribeFailedPages(database->path(), failed), "; "));
  return absl::OkStatus();
}

// Checks the file itself before its content, so that the error names the first cause. Returns
// whether the file is as this program writes it.
absl::StatusOr<bool> CheckFile(Database* database, int64_t size, bool has_log,
                               const GeoPackageOptions& options, absl::Status* damage) {
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t version, ReadSchemaVersion(database));
  if (sqlite3_db_readonly(database->handle(), "main") != 0) {
    return absl::FailedPreconditionError("the file is read-only");
  }
  HYPERMAP_RETURN_IF_ERROR(CheckIsNotNewer(version, kSchemaVersion));
  HYPERMAP_RETURN_IF_ERROR(CheckLength(database, size, has_log));
  if (size <= options.max_checked_bytes) {
    HYPERMAP_RETURN_IF_ERROR(CheckPages(database, damage));
  }
  return version == kSchemaVersion && KeepsChecksums(database->handle());
}

// Migrates a copy by VACUUM INTO that nobody else has open.
absl::Status MigrateCopy(const std::string& path, const GeoPackageOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::unique_ptr<Database> database,
      Database::Open(path, Database::OpenMode::kExisting, options.busy_timeout));
  HYPERMAP_RETURN_IF_ERROR(RegisterSpatialFunctions(database.get()));
  HYPERMAP_RETURN_IF_ERROR(MigrateSchema(database.get(), kSchemaVersion, ReleasedMigrations()));
  return RecordCopy(database.get());
}

// Puts a map of the newest version, with checksums, in the place of one without. `copy`, which is
// the name for the file as it was, may be empty; then that file is gone.
absl::Status WriteAnew(std::unique_ptr<Database> database, const std::string& path,
                       const std::string& copy, const GeoPackageOptions& options) {
  const std::string temporary = path + ".new";
  absl::Status status = RemoveMapFile(temporary);
  // Without memory of its own, for files of any size.
  if (status.ok()) status = database->Run("VACUUM INTO ?", temporary);
  // SQLite takes a file whose size it can't read for one that exists.
  if (absl::IsInternal(status)) status = absl::UnavailableError(status.message());
  // Moves the log into the file.
  database.reset();
  if (status.ok() && PathExists(LogPathOf(path))) {
    status = absl::UnavailableError("another program has the file open");
  }
  if (status.ok()) status = MigrateCopy(temporary, options);
  if (status.ok() && !copy.empty()) status = RemoveFile(copy);
  if (status.ok() && !copy.empty()) status = LinkOrCopyFile(path, copy);
  if (status.ok()) status = ReplaceFile(temporary, path);
  if (status.ok()) return status;
  RemoveMapFile(temporary).IgnoreError();
  return absl::Status(
      status.code(),
      absl::StrCat("the file has an older format, and can't be written anew: ", status.message()));
}

// A file of an older version is migrated. Its copy, OlderCopyOf, is kept unless `copy` is null;
// `copy` gets its name.
absl::StatusOr<std::unique_ptr<Database>> OpenAndMigrate(const std::string& path,
                                                         const GeoPackageOptions& options,
                                                         std::string* copy, absl::Status* damage) {
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t size, SizeOfFile(path));
  const bool has_log = PathExists(LogPathOf(path));
  const auto open = [&] {
    return Database::Open(path, Database::OpenMode::kExisting, options.busy_timeout);
  };
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Database> database, open());
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_current,
                            CheckFile(database.get(), size, has_log, options, damage));
  if (!is_current) {
    HYPERMAP_RETURN_IF_ERROR(*damage);
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t version, ReadSchemaVersion(database.get()));
    std::string kept;
    if (copy != nullptr && version < kSchemaVersion) kept = OlderCopyOf(path, version);
    HYPERMAP_RETURN_IF_ERROR(WriteAnew(std::move(database), path, kept, options));
    if (copy != nullptr) *copy = std::move(kept);
    HYPERMAP_ASSIGN_OR_RETURN(database, open());
  }
  HYPERMAP_RETURN_IF_ERROR(RegisterSpatialFunctions(database.get()));
  HYPERMAP_RETURN_IF_ERROR(VerifySchema(database.get()));
  HYPERMAP_RETURN_IF_ERROR(WriteAhead(database.get()));
  HYPERMAP_RETURN_IF_ERROR(LimitSize(database.get(), options.max_map_bytes));
  return database;
}

absl::StatusOr<std::optional<uint64_t>> ReadIncarnationOfFileAlone(const std::string& path) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::unique_ptr<Database> database,
      Database::Open(path, Database::OpenMode::kFileAlone, absl::ZeroDuration()));
  // Another program may have written to the file.
  const UnverifiedReads here(database->handle());
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> has_column,
      database->QueryInt64(
          "SELECT sum(name = 'incarnation') FROM pragma_table_info('hypermap_metadata')"));
  if (!has_column) return std::nullopt;
  if (*has_column == 0) return std::optional<uint64_t>(0);
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> incarnation,
      database->QueryInt64("SELECT incarnation FROM hypermap_metadata WHERE id = 1"));
  if (!incarnation) return std::nullopt;
  return static_cast<uint64_t>(*incarnation);
}

absl::Status Build(const std::string& path, const MapHeader& header,
                   const GeoPackageOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<Database> database,
      Database::Open(path, Database::OpenMode::kCreate, options.busy_timeout));
  return CreateSchema(database.get(), header);
}

// Reads the metadata of a file that nobody writes to, without changing it.
absl::StatusOr<MapMetadata> PeekMetadata(const std::string& path) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::unique_ptr<Database> database,
      Database::Open(path, ModeForReading(path), GeoPackageOptions().busy_timeout));
  return ReadMetadata(database.get());
}

}  // namespace

absl::Status CreateMapFile(const std::string& path, const std::string& temporary,
                           const MapHeader& header, const GeoPackageOptions& options) {
  absl::Status status = RemoveMapFile(temporary);
  // SQLite would apply a leftover write-ahead log of an earlier map of this name to the new file.
  if (status.ok()) status = RemoveSidecars(path);
  if (status.ok()) status = Build(temporary, header, options);
  if (status.ok()) status = PublishFile(temporary, path);
  if (!status.ok()) RemoveMapFile(temporary).IgnoreError();
  return status;
}

absl::StatusOr<OpenMap> OpenMapFile(const std::string& path, const GeoPackageOptions& options) {
  OpenMap map;
  HYPERMAP_ASSIGN_OR_RETURN(map.was_written_by_others, AdoptForeignWrites(path, options));
  HYPERMAP_ASSIGN_OR_RETURN(map.database,
                            OpenAndMigrate(path, options, &map.older_copy, &map.damage));
  return map;
}

std::string OlderCopyOf(const std::string& path, int64_t version) {
  return absl::StrCat(path, ".schema-", version);
}

absl::Status MigrateMapFile(const std::string& path, const GeoPackageOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(AdoptForeignWrites(path, options).status());
  absl::StatusOr<int64_t> version;
  {
    HYPERMAP_ASSIGN_OR_RETURN(
        const std::unique_ptr<Database> database,
        Database::Open(path, Database::OpenMode::kFileAlone, options.busy_timeout));
    version = ReadSchemaVersion(database.get());
  }
  if (absl::IsDataLoss(version.status())) return absl::OkStatus();
  HYPERMAP_RETURN_IF_ERROR(version.status());
  // Closing the connection moves the log into the file.
  if (*version == kSchemaVersion) return absl::OkStatus();
  absl::Status damage;
  return OpenAndMigrate(path, options, nullptr, &damage).status();
}

absl::Status MarkRestored(const std::string& path, const std::string& request_id,
                          const GeoPackageOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::unique_ptr<Database> database,
      Database::Open(path, Database::OpenMode::kExisting, options.busy_timeout));
  HYPERMAP_RETURN_IF_ERROR(database->Execute("PRAGMA synchronous = FULL"));
  HYPERMAP_ASSIGN_OR_RETURN(const MapMetadata metadata, ReadMetadata(database.get()));
  if (metadata.header.unfinished_copy) {
    return absl::FailedPreconditionError("the file is an unfinished copy of a map");
  }
  HYPERMAP_RETURN_IF_ERROR(SetCreation(database.get(), request_id));
  return SetComplete(database.get());
}

bool WasMadeBy(const std::string& path, const std::string& request_id) {
  if (request_id.empty()) return false;
  const absl::StatusOr<MapMetadata> metadata = PeekMetadata(path);
  return metadata.ok() && metadata->header.request_id == request_id;
}

bool IsUnfinishedCopy(const std::string& path) {
  const absl::StatusOr<MapMetadata> metadata = PeekMetadata(path);
  return metadata.ok() && metadata->header.unfinished_copy;
}

std::string LogPathOf(const std::string& path) { return absl::StrCat(path, "-wal"); }

std::string OrphanPathOf(const std::string& path) {
  return absl::StrCat(LogPathOf(path), ".orphan");
}

absl::Status SetLogAside(const std::string& path) {
  const std::string log = LogPathOf(path);
  const std::string orphan = OrphanPathOf(path);
  if (rename(log.c_str(), orphan.c_str()) != 0) {
    return FileError(errno, absl::StrCat("cannot rename ", log, " to ", orphan));
  }
  HYPERMAP_RETURN_IF_ERROR(RemoveFile(path + "-shm"));
  return SyncFolder(FolderOf(path));
}

absl::StatusOr<std::optional<uint64_t>> ReadIncarnationWithoutLog(const std::string& path) {
  absl::StatusOr<std::optional<uint64_t>> incarnation = ReadIncarnationOfFileAlone(path);
  const absl::Status& status = incarnation.status();
  const bool may_pass = absl::IsUnavailable(status) || absl::IsResourceExhausted(status);
  if (status.ok() || may_pass) return incarnation;
  return std::nullopt;
}

absl::Status CheckIntegrity(Database* database) {
  return RunCheck(database, "PRAGMA integrity_check(1)");
}

bool IsReadError(absl::string_view problem) {
  constexpr absl::string_view kCode = "unable to get the page. error code=";
  // An overflow page; its number was found to be valid before.
  if (absl::StrContains(problem, "failed to get page")) return true;
  const size_t at = problem.find(kCode);
  if (at == absl::string_view::npos) return false;
  const absl::string_view code = problem.substr(at + kCode.size());
  int number = 0;
  return absl::SimpleAtoi(code.substr(0, code.find_first_not_of("0123456789")), &number) &&
         (number & 0xff) == SQLITE_IOERR;
}

absl::StatusOr<bool> MoveLogIntoFile(Database* database) {
  // The first column tells whether a reader or writer was in the way.
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> is_busy,
                            database->QueryInt64("PRAGMA wal_checkpoint(TRUNCATE)"));
  return is_busy == 0;
}

Database::OpenMode ModeForReading(const std::string& path) {
  const bool is_alone = !PathExists(LogPathOf(path)) && !PathExists(path + "-journal");
  return is_alone ? Database::OpenMode::kFileAlone : Database::OpenMode::kReadOnly;
}

absl::Status RemoveSidecars(const std::string& path) {
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    HYPERMAP_RETURN_IF_ERROR(RemoveFile(path + suffix));
  }
  return absl::OkStatus();
}

absl::Status RemoveMapFile(const std::string& path) {
  // The file is removed before its log, which may contain commits that the file does not have.
  HYPERMAP_RETURN_IF_ERROR(RemoveFile(path));
  HYPERMAP_RETURN_IF_ERROR(RemoveSidecars(path));
  HYPERMAP_RETURN_IF_ERROR(RemoveFile(OrphanPathOf(path)));
  return SyncFolder(FolderOf(path));
}

}  // namespace hypermap::storage
