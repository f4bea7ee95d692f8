// Which request deleted which map: DATA_DIR/catalog.sqlite. What a map's own file can't remember.
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

// A deletion is begun, the file removed, and the deletion finished; one that is found begun after a
// crash is to be carried out. One thread at a time.
class DeletionLog {
 public:
  // Makes the file when it is missing. DATA_LOSS or FAILED_PRECONDITION when it can't be read.
  static absl::StatusOr<std::unique_ptr<DeletionLog>> Open(const std::string& path,
                                                           absl::Duration busy_timeout);

  // Durable when it returns the deletion's number. An empty request id is not looked for.
  absl::StatusOr<int64_t> Begin(const std::string& request_id, const std::string& map);
  absl::Status Finish(int64_t deletion);
  absl::Status Cancel(int64_t deletion);

  // The map that the request deleted.
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
