#include "storage/geopackage/open_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <cerrno>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/map_file.h"

namespace hypermap::storage {
namespace {

// Number of pages in the log after which it is moved into the file: SQLite's own default.
constexpr int kPagesPerCheckpoint = 1000;

}  // namespace

absl::StatusOr<OpenFiles::Stamp> OpenFiles::Look(const std::string& path, unsigned times) {
  struct statx status;
  // The file is not opened, because closing it would release the locks that SQLite holds on it.
  if (statx(AT_FDCWD, path.c_str(), 0, STATX_INO | STATX_SIZE | times, &status) == 0) {
    return Stamp{makedev(status.stx_dev_major, status.stx_dev_minor), status.stx_ino,
                 static_cast<int64_t>(status.stx_size),
                 times == 0 ? 0
                            : int64_t{status.stx_mtime.tv_sec} * 1'000'000'000 +
                                  int64_t{status.stx_mtime.tv_nsec}};
  }
  if (errno == ENOENT || errno == ENOTDIR) return absl::NotFoundError(path);
  const int error = errno;
  return absl::UnavailableError(absl::ErrnoToStatus(error, path).message());
}

absl::StatusOr<OpenFiles::Stamp> OpenFiles::LookAtFile(const std::string& path) {
  return Look(path, STATX_MTIME);
}

// Without its time: once that was asked for, Linux gives the log a new time at the next write
// (since 6.13, multigrain timestamps), and fdatasync then writes the log's inode as well, at each
// commit.
absl::StatusOr<OpenFiles::Stamp> OpenFiles::LookAtLog(const std::string& path) {
  return Look(path, 0);
}

absl::Status OpenFiles::ProblemOf(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return absl::OkStatus();
    case Fault::kRemoved:
      return absl::DataLossError("the file of the map was removed while the map was open");
    case Fault::kReplaced:
      return absl::DataLossError("the file of the map was replaced while the map was open");
    case Fault::kOverwritten:
      return absl::DataLossError("the file of the map was overwritten while the map was open");
    case Fault::kLogRemoved:
      return absl::DataLossError(
          "the write-ahead log of the map was removed while the map was open");
    case Fault::kLogShortened:
      return absl::DataLossError(
          "the write-ahead log of the map was shortened while the map was open");
  }
  return absl::InternalError("unknown fault of a map's files");
}

absl::StatusOr<std::unique_ptr<OpenFiles>> OpenFiles::Attach(Database* writer) {
  const absl::StatusOr<Stamp> file = LookAtFile(writer->path());
  const absl::StatusOr<Stamp> log = LookAtLog(LogPathOf(writer->path()));
  if (absl::IsNotFound(file.status())) return ProblemOf(Fault::kRemoved);
  if (absl::IsNotFound(log.status())) return ProblemOf(Fault::kLogRemoved);
  HYPERMAP_RETURN_IF_ERROR(file.status());
  HYPERMAP_RETURN_IF_ERROR(log.status());
  std::unique_ptr<OpenFiles> files(new OpenFiles(writer, *file, *log));
  sqlite3_wal_hook(writer->handle(), &OpenFiles::AfterCommit, files.get());
  return files;
}

OpenFiles::OpenFiles(Database* writer, const Stamp& file, const Stamp& log)
    : writer_(writer),
      log_path_(LogPathOf(writer->path())),
      opened_(file),
      file_(file),
      log_(log) {}

OpenFiles::~OpenFiles() { sqlite3_wal_hook(writer_->handle(), nullptr, nullptr); }

int OpenFiles::AfterCommit(void* files, sqlite3* /*handle*/, const char* schema, int log_pages) {
  if (absl::string_view(schema) == "main") static_cast<OpenFiles*>(files)->Committed(log_pages);
  return SQLITE_OK;
}

void OpenFiles::Committed(int log_pages) {
  if (fault_ != Fault::kNone) return;
  Stamp log;
  const absl::StatusOr<Fault> fault = FindFault(&log);
  if (!fault.ok()) return;  // The next Check tells it.
  fault_ = *fault;
  if (fault_ != Fault::kNone) return;
  // SQLite itself may have shortened it, because of PRAGMA journal_size_limit.
  log_ = log;
  if (log_pages < kPagesPerCheckpoint) return;
  // The checkpoint that SQLite would run without this hook. If it fails, the next commit tries it
  // again; the commit itself is in the log.
  sqlite3_wal_checkpoint(writer_->handle(), "main");
  Remember();
  Check().IgnoreError();
}

bool OpenFiles::Remember() {
  const absl::StatusOr<Stamp> file = LookAtFile(writer_->path());
  const absl::StatusOr<Stamp> log = LookAtLog(log_path_);
  // Check finds files that were replaced during a checkpoint: they are other files then.
  if (file.ok() && file->SameFile(opened_)) file_ = *file;
  if (log.ok() && log->SameFile(log_)) log_ = *log;
  const auto is_seen = [](const absl::Status& status) {
    return status.ok() || absl::IsNotFound(status);
  };
  is_known_ = is_seen(file.status()) && is_seen(log.status());
  return is_known_;
}

absl::Status OpenFiles::Check() {
  if (fault_ == Fault::kNone) {
    HYPERMAP_ASSIGN_OR_RETURN(fault_, FindFaultOrShorterLog());
  }
  return ProblemOf(fault_);
}

absl::StatusOr<OpenFiles::Fault> OpenFiles::FindFault(Stamp* log_now) {
  if (!is_known_ && !Remember()) {
    return absl::UnavailableError(absl::StrCat(writer_->path(), ": the file can't be looked at"));
  }
  const absl::StatusOr<Stamp> file = LookAtFile(writer_->path());
  if (absl::IsNotFound(file.status())) return Fault::kRemoved;
  HYPERMAP_RETURN_IF_ERROR(file.status());
  if (!file->SameFile(file_)) return Fault::kReplaced;
  if (file->size != file_.size || file->modified_ns != file_.modified_ns) {
    return Fault::kOverwritten;
  }
  const absl::StatusOr<Stamp> log = LookAtLog(log_path_);
  if (absl::IsNotFound(log.status())) return Fault::kLogRemoved;
  HYPERMAP_RETURN_IF_ERROR(log.status());
  if (!log->SameFile(log_)) return Fault::kLogRemoved;
  *log_now = *log;
  return Fault::kNone;
}

absl::StatusOr<OpenFiles::Fault> OpenFiles::FindFaultOrShorterLog() {
  Stamp log{};
  HYPERMAP_ASSIGN_OR_RETURN(const Fault fault, FindFault(&log));
  if (fault != Fault::kNone) return fault;
  return log.size < log_.size ? Fault::kLogShortened : Fault::kNone;
}

absl::Status OpenFiles::CheckIdentity() const {
  const absl::StatusOr<Stamp> file = LookAtFile(writer_->path());
  if (absl::IsNotFound(file.status())) return ProblemOf(Fault::kRemoved);
  HYPERMAP_RETURN_IF_ERROR(file.status());
  return ProblemOf(file->SameFile(opened_) ? Fault::kNone : Fault::kReplaced);
}

absl::StatusOr<OpenFiles::Fault> OpenFiles::FindFaultAtEnd() {
  // Commits may be missing in a log that was shortened, also if it has grown again since. All other
  // faults may have passed: no commit was written while they lasted.
  if (fault_ == Fault::kLogShortened) return fault_;
  return FindFaultOrShorterLog();
}

void OpenFiles::RecordEnd() {
  // While another program has the file open, the log stays, and that program may move it. After an
  // error, SQLite tries again when it closes the file.
  const auto log_stays = [this] { return !MoveLogIntoFile(writer_).value_or(true); };
  if (log_stays() || !RecordClosing(writer_).ok()) return;
  if (log_stays()) RecordOpening(writer_).IgnoreError();
}

void OpenFiles::Finish() {
  const absl::StatusOr<Fault> fault = FindFaultAtEnd();
  const bool is_whole = fault.ok() && *fault == Fault::kNone;
  // A log that was removed by name can still be read by the connection that has it open, and the
  // file is ours: the commits of the log are saved.
  if (is_whole || (fault.ok() && *fault == Fault::kLogRemoved)) {
    RecordEnd();
  }
  if (is_whole) return;
  sqlite3_db_config(writer_->handle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  const bool file_is_foreign =
      fault.ok() &&
      (*fault == Fault::kRemoved || *fault == Fault::kReplaced || *fault == Fault::kOverwritten);
  const absl::StatusOr<Stamp> log = LookAtLog(log_path_);
  if (file_is_foreign && log.ok() && log->SameFile(log_)) {
    SetLogAside(writer_->path()).IgnoreError();
  }
}

}  // namespace hypermap::storage
