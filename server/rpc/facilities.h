// The dependencies and limits of all services.
#ifndef HYPERMAP_SERVER_RPC_FACILITIES_H_
#define HYPERMAP_SERVER_RPC_FACILITIES_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "hypermap/v1/scope.pb.h"
#include "server/auth/access_control.h"
#include "server/forward/forwarder.h"
#include "server/rpc/budgets.h"
#include "server/rpc/call_context.h"
#include "server/rpc/timer_queue.h"
#include "server/rpc/worker_pools.h"
#include "server/session/site.h"

namespace hypermap::server {

// All pointers must outlive the services.
struct Facilities {
  Site* site;
  Limits limits;
  WorkerPools* workers;
  // A folder that no other server uses, for files that live as long as a request.
  std::string scratch_dir;
  Budgets* budgets;
  AccessControl* access;
  RpcMeters* meters;
  TimerQueue* timers;
  // Passes calls on to the owners of maps; null if this server owns all of its maps.
  Forwarder* forwarder = nullptr;

  CallFacilities for_calls() const { return {budgets, access, meters, site, forwarder}; }
};

// The session of the map that a request names. INVALID_ARGUMENT for a name that no map can have;
// NOT_FOUND; or the error with which the map could not be opened.
absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const std::string& map);
// As above. ABORTED if the map is another incarnation than the request expects; 0 expects any.
absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const std::string& map, uint64_t incarnation);
absl::StatusOr<std::shared_ptr<MapSession>> FindMap(const Facilities& facilities,
                                                    const v1::Scope& scope);

// INVALID_ARGUMENT for a request id that is too long to be stored.
absl::Status ValidateRequestId(const std::string& request_id);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_FACILITIES_H_
