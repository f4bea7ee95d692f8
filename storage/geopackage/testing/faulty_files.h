// Files that fail, for tests of what SQLite and the store above it keep.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TESTING_FAULTY_FILES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TESTING_FAULTY_FILES_H_

#include <sqlite3.h>
#include <sys/types.h>

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "storage/geopackage/testing/simulated_disk.h"

namespace hypermap::storage {

// Calls of SQLite that can fail. kLock and kShm concern locks and the index of the write-ahead log.
enum class FileCall {
  kOpen,
  kRead,
  kWrite,
  kTruncate,
  kSync,
  kSize,
  kDelete,
  kAccess,
  kLock,
  kShm
};
constexpr int kNumFileCalls = 10;

// A failure of one or more calls.
struct FileFault {
  FileCall call = FileCall::kWrite;
  int code = SQLITE_IOERR_WRITE;  // the answer of the call
  int first = 1;                  // the call that fails first, counted from 1
  int count = 1;                  // how many calls fail, one after the other
  bool writes_half = false;       // of a write: the first half of the bytes is written
};

// A VFS of SQLite that is the default one as long as it lives. It records and counts the calls for
// the files in one folder, makes some of them fail, and hands all to the real VFS. Only syncs are
// not carried out, so that tests are fast: a power loss is simulated (SimulatedDisk).
//
// Files that are written without SQLite are not seen. Removals and renamings by others are noticed
// at the next call, and taken for durable. An index of a write-ahead log (-shm) is not recorded,
// because SQLite makes it anew after a crash.
//
// Not thread safe. REQUIRES: connections that are opened while it lives are closed before it dies;
// at most one lives at a time.
class FaultyFiles {
 public:
  // `witness_name`: a file in the folder whose content is recorded with each event; empty: none.
  explicit FaultyFiles(std::string folder, std::string witness_name = "");
  ~FaultyFiles();
  FaultyFiles(const FaultyFiles&) = delete;
  FaultyFiles& operator=(const FaultyFiles&) = delete;

  // Counts calls from now on for the files whose name in the folder is accepted, and makes those of
  // `fault` fail.
  void Arm(std::function<bool(absl::string_view)> files, const FileFault& fault);
  // Only counts.
  void Count(std::function<bool(absl::string_view)> files);
  // From now on no call fails.
  void Disarm() { fault_.count = 0; }

  // Calls since Arm or Count.
  int num_calls(FileCall call) const { return calls_[static_cast<int>(call)]; }
  // Calls that have failed since Arm.
  int num_failed() const { return failed_; }

  // Adds a note to the recorded events.
  void Note(int64_t number);
  const std::vector<FileEvent>& events() const { return events_; }

 private:
  friend struct FaultyFile;
  struct NamedFile {
    int id;
    ino_t inode;
  };

  static FaultyFiles* Of(sqlite3_vfs* vfs) { return static_cast<FaultyFiles*>(vfs->pAppData); }
  static int Open(sqlite3_vfs* vfs, const char* path, sqlite3_file* file, int flags,
                  int* flags_out);
  static int Delete(sqlite3_vfs* vfs, const char* path, int sync_folder);
  static int Access(sqlite3_vfs* vfs, const char* path, int flags, int* result);

  // The name of a file of the folder; empty if it is in another one.
  std::string NameOf(const char* path) const;
  // Counts a call, and returns whether it fails.
  bool Fails(FileCall call, const std::string& name);
  void Record(FileEvent event);
  // Records files that were renamed or removed by others.
  void FindChangedNames();
  // The number of a file that SQLite has opened.
  int Identify(const std::string& name, bool is_new);

  const std::string folder_;
  const std::string witness_name_;
  sqlite3_vfs* const real_;
  sqlite3_vfs vfs_;
  std::map<std::string, NamedFile> names_;
  int num_files_ = 0;
  std::vector<FileEvent> events_;
  std::function<bool(absl::string_view)> counted_;
  FileFault fault_;
  int failed_ = 0;
  std::array<int, kNumFileCalls> calls_{};
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TESTING_FAULTY_FILES_H_
