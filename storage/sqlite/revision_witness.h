// The witness of a map or an outbox: a record of the newest acknowledged revision outside of its
// file.
//
// It is kept in the lock file, which is open as long as the other file is. It is written after each
// commit and before the acknowledgement, without waiting for the disk. It therefore survives the
// death of the process. After a power cut it may be older than the file, so that a loss may go
// unnoticed; it is never newer than what was acknowledged, so that no loss is told that did not
// happen.
#ifndef HYPERMAP_STORAGE_SQLITE_REVISION_WITNESS_H_
#define HYPERMAP_STORAGE_SQLITE_REVISION_WITNESS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/sqlite/file_lock.h"

namespace hypermap::storage {

struct RevisionWitness {
  uint64_t incarnation = 0;
  int64_t revision = 0;  // of an outbox: the number of its commits
  // The commit time of the revision in nanoseconds since the Unix epoch; 0 for revision 0, and of
  // an outbox.
  int64_t time_ns = 0;
  // True if the map's file has the incarnation without its write-ahead log.
  bool settled = false;

  friend bool operator==(const RevisionWitness&, const RevisionWitness&) = default;
};

// Always of the same size, so that writing it again needs no space on the disk.
std::string EncodeWitness(const RevisionWitness& witness);

// Nullopt if the bytes are not a whole witness of a known version.
std::optional<RevisionWitness> DecodeWitness(absl::string_view bytes);

// The witness in a lock file; nullopt if it has none that is whole. UNAVAILABLE if the file can't
// be read, which is no reason to take it for one without a witness.
absl::StatusOr<std::optional<RevisionWitness>> ReadWitness(const FileLock& lock);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_SQLITE_REVISION_WITNESS_H_
