// Writing much at once without making others wait for the disk.
#ifndef HYPERMAP_STORAGE_SQLITE_PACED_WRITES_H_
#define HYPERMAP_STORAGE_SQLITE_PACED_WRITES_H_

#include <cstdint>

namespace hypermap::storage {

// Sends what a thread writes to a file on to the disk in pieces, and waits for each, as RocksDB
// does with strict_bytes_per_sync. Otherwise the system keeps it in memory and writes all of it at
// once, at the next fsync of any file, which then takes as long as the disk needs for all of it.
// Costs nothing before the first piece is full. Not thread-safe.
class PacedWrites {
 public:
  static constexpr int64_t kPieceBytes = 256 << 10;

  // Tells that `bytes` were written to the file `fd`, the same as before or another one. Returns 0,
  // or the error (errno) of the disk. Then bytes that were written before are lost, and fsync does
  // not tell it again: the write has failed.
  int Wrote(int fd, int64_t bytes);

  // Begins a new piece: what was written before is on the disk.
  void Synced() { piece_bytes_ = 0; }

 private:
  int fd_ = -1;
  int64_t piece_bytes_ = 0;  // what was written to fd_ and not sent on
};

// While one lives, SQLite's writes on this thread are not sent on. For files that are removed soon
// and need not survive a crash: most of them never reach the disk.
class UnpacedWrites {
 public:
  UnpacedWrites();
  ~UnpacedWrites();
  UnpacedWrites(const UnpacedWrites&) = delete;
  UnpacedWrites& operator=(const UnpacedWrites&) = delete;
};

// Tells that all that SQLite wrote on this thread is on the disk. Without it, small commits, each
// of which was synced, would add up to a piece, and one of them would wait for the disk twice.
void SqliteHasSynced();

// Lets SQLite write all files of this process so. A piece that the disk did not take is an error of
// the write that filled it (SQLITE_IOERR or SQLITE_FULL).
void PaceWritesOfSqlite();

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_PACED_WRITES_H_
