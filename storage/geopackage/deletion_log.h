// DATA_DIR/catalog.sqlite: which request deleted which map. A deleted map has no file of its own to
// record it in.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_DELETION_LOG_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_DELETION_LOG_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// A deletion is begun here, then the map's file is removed, then the deletion is finished. A
// deletion that a crash left unfinished has to be carried out when the store is opened. One thread
// at a time.
class DeletionLog {
 public:
  // Makes the file when it is missing. DATA_LOSS or FAILED_PRECONDITION when it can't be read.
  static absl::StatusOr<std::unique_ptr<DeletionLog>> Open(const std::string& path,
                                                           absl::Duration busy_timeout);

  // Begins a deletion and returns its number; it is durable then. Find ignores empty request ids.
  absl::StatusOr<int64_t> Begin(const std::string& request_id, const std::string& map);
  absl::Status Finish(int64_t deletion);
  absl::Status Cancel(int64_t deletion);

  // The map that the request deleted; nullopt when it deleted none.
  absl::StatusOr<std::optional<std::string>> Find(const std::string& request_id);

  struct Pending {
    int64_t deletion = 0;
    std::string map;
  };
  absl::StatusOr<std::vector<Pending>> FindPending();

 private:
  explicit DeletionLog(std::unique_ptr<Database> database) : database_(std::move(database)) {}

  std::unique_ptr<Database> database_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_DELETION_LOG_H_
