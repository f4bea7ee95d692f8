// The files of an open map, as they were last written here.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_OPEN_FILES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_OPEN_FILES_H_

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Notices that the file of an open map or its write-ahead log was removed, replaced or overwritten
// by name. SQLite would go on writing to files that nobody can open any more, or mix two files
// (https://www.sqlite.org/howtocorrupt.html). Used by the map's writer, except where a method says
// otherwise.
//
// In write-ahead mode only a checkpoint writes to the file itself. This class runs the checkpoints
// of the writer's connection, so that it knows how each of them leaves the file; readers of the
// history run none. A checkpoint by another program looks like a change of the file.
class OpenFiles {
 public:
  // Remembers the files as they are, and from now on runs the automatic checkpoints of `writer`,
  // which must outlive this object. REQUIRES: `writer` has the file and its log open.
  static absl::StatusOr<std::unique_ptr<OpenFiles>> Attach(Database* writer);
  ~OpenFiles();
  OpenFiles(const OpenFiles&) = delete;
  OpenFiles& operator=(const OpenFiles&) = delete;

  // DATA_LOSS, for ever, once the files are not as the writer left them. UNAVAILABLE if that can't
  // be told now.
  absl::Status Check();

  // What the last Check or commit found, without another look.
  absl::Status problem() const { return ProblemOf(fault_); }

  // Checks whether the path still names the file that was opened. Any thread may call this.
  absl::Status CheckIdentity() const;

  // Moves the log into the file, unless that is another file by now. If it is, keeps our log from
  // being applied to it, now and at the next opening. A file that was away, and is back as the
  // writer left it, is ours. The connection must be closed next.
  void Finish();

 private:
  // Moves the log into the file, and notes there that it is.
  void RecordEnd();
  enum class Fault { kNone, kRemoved, kReplaced, kOverwritten, kLogRemoved, kLogShortened };
  struct Stamp {
    dev_t device;
    ino_t inode;
    int64_t size;
    int64_t modified_ns;  // 0 for the log

    bool SameFile(const Stamp& other) const {
      return device == other.device && inode == other.inode;
    }
  };

  OpenFiles(Database* writer, const Stamp& file, const Stamp& log);

  // NOT_FOUND if the path names nothing. `times` is 0 or STATX_MTIME.
  static absl::StatusOr<Stamp> Look(const std::string& path, unsigned times);
  static absl::StatusOr<Stamp> LookAtFile(const std::string& path);
  static absl::StatusOr<Stamp> LookAtLog(const std::string& path);
  static absl::Status ProblemOf(Fault fault);
  // The callback of sqlite3_wal_hook, which calls Committed.
  static int AfterCommit(void* files, sqlite3* handle, const char* schema, int log_pages);
  // Looks at the files once the log has `log_pages` pages by a commit; runs a checkpoint if they
  // are many.
  void Committed(int log_pages);

  // Without a fault, `log_now` becomes the log as it is now, and the file is as it was left.
  absl::StatusOr<Fault> FindFault(Stamp* log_now);
  absl::StatusOr<Fault> FindFaultOrShorterLog();
  // The fault that matters when the map is closed.
  absl::StatusOr<Fault> FindFaultAtEnd();
  // Remembers the files after the writer has written to them. If they can't be looked at now, that
  // is done before they are next compared. Returns whether they are known.
  bool Remember();

  Database* const writer_;
  const std::string log_path_;
  const Stamp opened_;  // the file when it was opened
  Stamp file_;
  Stamp log_;
  Fault fault_ = Fault::kNone;
  bool is_known_ = true;  // file_ and log_ are what the writer has left
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_OPEN_FILES_H_
