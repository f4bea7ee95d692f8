// The dependencies and limits of all services.
#ifndef HYPERMAP_SERVER_RPC_FACILITIES_H_
#define HYPERMAP_SERVER_RPC_FACILITIES_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/rpc/worker_pool.h"
#include "server/session/site.h"
#include "wire/limits.h"

namespace hypermap::server {

// A request that exceeds a limit is refused with RESOURCE_EXHAUSTED, naming the flag of that name.
// The chunk sizes bound the messages of streamed answers instead.
struct ServiceLimits {
  wire::DecodeLimits decode;
  int max_nearest = 1000;
  int max_points = 65'536;
  int64_t max_import_bytes = int64_t{256} << 20;
  // Number of cells in the box around an explored area.
  int64_t max_exploration_cells = 25'000'000;
  int chunk_items = 2048;
  int64_t max_chunk_bytes = 256 << 10;
  int max_watchers = 1000;
  // Number of revisions that a watch may fall behind.
  int64_t max_watch_lag = 500'000;
  // Longest time between two messages of a watch.
  absl::Duration watch_progress = absl::Seconds(10);
};

// All pointers must outlive the services.
struct Facilities {
  Site* site;
  ServiceLimits limits;
  // For queries and edits: short tasks.
  WorkerPool* workers;
  // For tasks that read or write files, which take long.
  WorkerPool* file_workers;
  // For explorations, whose calls wait for commits and for each other.
  WorkerPool* explorers;
  // A folder that no other server uses, for files that live as long as a request.
  std::string scratch_dir;
};

// The session of the map that a request names. INVALID_ARGUMENT for a name that no map can have;
// NOT_FOUND; or the error with which the map could not be opened.
absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const std::string& map);

// INVALID_ARGUMENT for a request id that is too long to be stored.
absl::Status ValidateRequestId(const std::string& request_id);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_FACILITIES_H_
