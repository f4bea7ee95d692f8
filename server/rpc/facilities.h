// What all services work with.
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

// Past one of these a request is refused with RESOURCE_EXHAUSTED naming the flag of that name. The
// chunk sizes bound a part of a streamed answer instead.
struct ServiceLimits {
  wire::DecodeLimits decode;
  int max_nearest = 1000;
  int max_points = 65'536;
  int64_t max_import_bytes = int64_t{256} << 20;
  // Cells in the box round an area that is explored.
  int64_t max_exploration_cells = 25'000'000;
  int chunk_items = 2048;
  int64_t max_chunk_bytes = 256 << 10;
  int max_watchers = 1000;
  // Revisions that a watch may fall behind.
  int64_t max_watch_lag = 500'000;
  // How long a watch may be silent.
  absl::Duration watch_progress = absl::Seconds(10);
};

// All outlive the services.
struct Facilities {
  Site* site;
  ServiceLimits limits;
  // For questions and edits: short tasks.
  WorkerPool* workers;
  // For files, which take long to read and to write.
  WorkerPool* file_workers;
  // For explorations, whose calls wait for commits and for each other.
  WorkerPool* explorers;
  // Of this server alone; for files that live as long as a request.
  std::string scratch_dir;
};

// The session of the map that a request names. INVALID_ARGUMENT for a name that no map can have,
// NOT_FOUND, or the problem with the map.
absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const std::string& map);

// INVALID_ARGUMENT for a request id that is too long to be kept.
absl::Status ValidateRequestId(const std::string& request_id);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_FACILITIES_H_
