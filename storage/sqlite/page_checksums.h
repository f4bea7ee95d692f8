// Checksums of the pages of a database, so that a bit that flips on a disk is an error instead of a
// wrong answer.
//
// The format is that of SQLite's own extension (https://www.sqlite.org/cksumvfs.html): pages have 8
// reserved bytes at their end, which contain a checksum of the rest. Programs without the extension
// read such a file as any other; what they write has no valid checksum (AdoptPages).
//
// Every database that is opened with ChecksumVfs is verified if it has the reserved bytes; a new
// one must get them (KeepChecksums). A page that fails is an error of the statement that needs it:
// SQLITE_IOERR_DATA, which Database maps to DATA_LOSS with the number of the page. Pages in a
// write-ahead log are not verified: its frames have checksums of their own, which SQLite verifies
// when it recovers the log.
//
// The same layer makes a write-ahead log durable where SQLite believes too much: it syncs the
// folder of a new log, and writes a log again whose last sync is unknown or has failed.
#ifndef HYPERMAP_STORAGE_SQLITE_PAGE_CHECKSUMS_H_
#define HYPERMAP_STORAGE_SQLITE_PAGE_CHECKSUMS_H_

#include <sqlite3.h>

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"

namespace hypermap::storage {

// Bytes at the end of each page that are reserved for its checksum.
inline constexpr int kPageChecksumBytes = 8;

// The name of the layer between SQLite and the files of the system that was the default when it was
// first asked for. Registered on the first call; null if there is no memory for it.
const char* ChecksumVfs();

// Writes the checksum of a page into its last 8 bytes. REQUIRES: the size is a power of two of at
// least 512.
void SetPageChecksum(absl::Span<unsigned char> page);

// Returns whether the last 8 bytes of a page are its checksum.
bool HasValidChecksum(absl::Span<const unsigned char> page);

// Lets a database that has no table yet keep checksums, and all copies that VACUUM INTO makes.
// Others keep them after their next VACUUM.
void KeepChecksums(sqlite3* database);

// Returns whether the file of a connection keeps checksums. Known after the first read.
bool KeepsChecksums(sqlite3* database);

// While one lives, a connection reads pages that fail. They stay in its cache, so that no read of
// that connection is verified afterwards. REQUIRES: its file was opened by ChecksumVfs().
class UnverifiedReads {
 public:
  explicit UnverifiedReads(sqlite3* database);
  ~UnverifiedReads();
  UnverifiedReads(const UnverifiedReads&) = delete;
  UnverifiedReads& operator=(const UnverifiedReads&) = delete;

 private:
  sqlite3* database_;
};

// Gives a valid checksum to each page of the file that has none, and syncs it. Returns their
// number. Nothing but the checksums changes, so that it may break off at any point. REQUIRES: the
// connection has the file locked, and there is no write-ahead log with content.
absl::StatusOr<int64_t> AdoptPages(sqlite3* database);

// Collects the numbers, from 1 on, of the pages that fail on this thread while it lives. SQLite's
// checks go on after a page that fails, and report it as they report a disk that fails.
class FailedPages {
 public:
  FailedPages();
  ~FailedPages();
  FailedPages(const FailedPages&) = delete;
  FailedPages& operator=(const FailedPages&) = delete;

  const std::set<int64_t>& numbers() const { return numbers_; }

  // Notes a page in all that live on this thread.
  static void Add(int64_t number);

 private:
  FailedPages* const outer_;  // the one that was made before on this thread; null if none lives
  std::set<int64_t> numbers_;
};

// A message that names a page that has failed.
std::string DescribeFailedPage(int64_t number);

// The page that failed last on this thread.
int64_t LastFailedPage();

// The error number of the last sync of a new journal's folder on this thread; 0: it was done.
int LastFolderError();

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_PAGE_CHECKSUMS_H_
