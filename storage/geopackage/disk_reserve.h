// Space on the disk that is kept for deletions, so that a full disk can be made emptier.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_DISK_RESERVE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_DISK_RESERVE_H_

#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "base/sync/mutex.h"

namespace hypermap::storage {

// A file whose blocks are allocated and given back to the file system when the disk is full. A
// deletion writes before it frees space, and so does the removal of history, whose freed pages are
// used again by later commits, although the map's file does not become smaller. Other writers may
// take the space that was given back: it helps only the operation that follows at once. The reserve
// is made again when there is space. Thread safe.
class DiskReserve {
 public:
  enum class Purpose {
    kHistory,   // may use all but the last quarter, since it happens without anybody's doing
    kDeletion,  // of a map: may use all
  };

  // Takes over the file if there is one, and makes none yet. `bytes` is the size; 0: the file is
  // removed, and there is no reserve.
  DiskReserve(std::string path, int64_t bytes);

  // Makes the reserve whole as far as there is space, and room for others beside it. Returns
  // whether it is whole. Cheap if it is.
  bool Keep();

  // Returns whether the reserve is whole, made so if possible, and there is room for others beside
  // it.
  bool HasRoom();

  // Runs the operation. If that fails because the disk is full, gives the reserve back and runs it
  // once more. The operation must change nothing when it fails.
  absl::Status Use(Purpose purpose, absl::FunctionRef<absl::Status()> operation);

 private:
  // Returns whether there was something to give back.
  bool Release(Purpose purpose);
  bool Resize(int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Returns whether an operation that failed with `status` may succeed when there is space.
  bool NeedsSpace(const absl::Status& status) const;
  // Bytes of the file system that this process may still use; 0 if that can't be told.
  int64_t AvailableBytes() const;

  int64_t deletion_bytes() const { return bytes_ / 4; }

  const std::string path_;
  const int64_t bytes_;
  Mutex mutex_;
  int64_t size_ ABSL_GUARDED_BY(mutex_) = 0;  // of the file, all of it allocated
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_DISK_RESERVE_H_
