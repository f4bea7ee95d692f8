// The seam between maps and what makes them durable.
#ifndef HYPERMAP_STORAGE_MAP_STORE_H_
#define HYPERMAP_STORAGE_MAP_STORE_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/edits/change.h"
#include "map/snapshot.h"
#include "storage/fusion_log.h"
#include "storage/history.h"

namespace hypermap::storage {

// What a mutation was answered, kept so that the same request gets the same answer again.
struct Receipt {
  std::string request_id;  // empty: the caller gave none, nothing is kept
  Revision revision = 0;
  std::vector<ObjectId> object_ids;  // AppliedBatch::object_ids
};

// One batch on its way to disk.
struct Commit {
  AppliedBatch applied;
  std::string author;
  absl::Time time;
  std::string request_id;
  // What it does to fused layers, each at most once. A layer that the batch deletes loses what was
  // kept of its fusion before.
  std::vector<FusionChange> fusion;
};

// What a map is from its creation on.
struct MapHeader {
  std::string name;
  std::string frame_id;
  absl::Time created_at;
  std::string request_id;  // of its creation
};

// One map, opened for writing by this process alone. One thread at a time.
class StoredMap {
 public:
  virtual ~StoredMap() = default;

  // As given at its creation; the name is the one it was opened by.
  virtual const MapHeader& header() const = 0;

  // All of the newest revision. DATA_LOSS naming what is damaged.
  virtual absl::StatusOr<SnapshotPtr> Load() = 0;

  // Makes the commits durable, all in one transaction, in order. On error nothing of them is
  // stored, and the map is as it was: UNAVAILABLE or RESOURCE_EXHAUSTED (disk full) may go away,
  // DATA_LOSS not.
  virtual absl::Status Write(absl::Span<const Commit> commits) = 0;

  // The receipt of an earlier request, also from before a restart.
  virtual absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) = 0;

  // Opens a way to read the map's history beside this. May be called by any thread; it may outlive
  // this, but reads nothing newer then.
  virtual absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() = 0;

  // From now on nothing before the revision `oldest` (at most the newest) can be read; a smaller
  // one than before changes nothing. Receipts of revisions made before `receipts_before` are
  // forgotten. Removes at most about `max_rows` rows that are no longer needed, in a short
  // transaction; true when more are left to remove.
  virtual absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before,
                                       int max_rows) = 0;

  // The evidence of fused layers. Lives as long as this.
  virtual FusionLog& fusion_log() = 0;

  // Writes a consistent copy that can be opened as a map of its own. The file must not exist.
  virtual absl::Status BackupTo(const std::string& path) = 0;
};

// A set of maps in one place, of which this process is the only writer. Thread safe.
class MapStore {
 public:
  virtual ~MapStore() = default;

  // Names of all maps found, sorted, whether or not they can be opened.
  virtual absl::StatusOr<std::vector<std::string>> List() = 0;

  // ALREADY_EXISTS.
  virtual absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& header) = 0;

  // NOT_FOUND; FAILED_PRECONDITION for a file that is no map, is of a newer version, or is open in
  // another process; DATA_LOSS for one that is damaged.
  virtual absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& name) = 0;

  // Removes the map for good and remembers the request (unless its id is empty): the same request
  // again changes nothing and is OK, also after a restart and when a map of that name was made
  // since. NOT_FOUND; FAILED_PRECONDITION when the map is open; INVALID_ARGUMENT when the id was
  // used to delete another map.
  virtual absl::Status Delete(const std::string& name, const std::string& request_id) = 0;

  // The map that the request deleted; nullopt when it deleted none.
  virtual absl::StatusOr<std::optional<std::string>> FindDeletion(
      const std::string& request_id) = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_MAP_STORE_H_
