// The gRPC server: all services on one port.
#ifndef HYPERMAP_SERVER_SERVICES_GRPC_SERVER_H_
#define HYPERMAP_SERVER_SERVICES_GRPC_SERVER_H_

#include <grpcpp/server.h>

#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/admission/grpc_listener.h"
#include "base/admission/open_connections.h"
#include "base/limits/limits.h"
#include "base/tls/server_credentials.h"
#include "server/forward/forwarder.h"
#include "server/rpc/budgets.h"
#include "server/rpc/facilities.h"
#include "server/rpc/timer_queue.h"
#include "server/services/access_service.h"
#include "server/services/catalog_service.h"
#include "server/services/edit_service.h"
#include "server/services/exploration_service.h"
#include "server/services/ingest_service.h"
#include "server/services/query_service.h"
#include "server/services/robot_service.h"
#include "server/services/server_service.h"
#include "server/watch/watch_service.h"
#include "wire/health/health_service.h"
#include "wire/reflection/reflection_service.h"

namespace hypermap::server {

struct GrpcServerOptions {
  // HOST:PORT; port 0 takes a free port.
  std::string listen;
  // Size limit of requests and responses.
  int max_message_bytes = Limits().max_message_bytes;
  tls::ServerFiles tls = {};
  admission::ConnectionLimits connections = {};
  // While more memory is resident, the connections that receive the most are shut down; 0: never.
  int64_t max_resident_bytes = 0;
  int max_calls_per_connection = Limits().max_calls_per_connection;
};

// Serves from Start to Shutdown: Hypermap's services, the standard health service (which reports
// all of them as SERVING until the shutdown begins) and reflection. The health service also knows
// kAdmissionService, which is NOT_SERVING while the server refuses calls for want of room, and for
// kOverloadPeriod afterwards, and kClockService, which is while a jump of the wall clock is not
// followed; the others go on SERVING then. A map is known by kMapPrefix and its name to callers
// that have access to it, and is NOT_SERVING if it can't be opened or has failed since. With
// kEditsSuffix it is also NOT_SERVING while its changes can't be stored.
class GrpcServer {
 public:
  static constexpr char kAdmissionService[] = "hypermap.admission";
  static constexpr char kClockService[] = "hypermap.clock";
  static constexpr char kMapPrefix[] = "map/";
  static constexpr char kEditsSuffix[] = "/edits";
  static constexpr absl::Duration kOverloadPeriod = absl::Seconds(10);

  // All pointers in `facilities` must outlive the server. INVALID_ARGUMENT for a malformed address
  // or unusable TLS files; UNAVAILABLE if the server can't listen on the address.
  static absl::StatusOr<std::unique_ptr<GrpcServer>> Start(const GrpcServerOptions& options,
                                                           const Facilities& facilities);
  ~GrpcServer();
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;

  // HOST:PORT with the actual port.
  const std::string& address() const;

  // Ends watches (also those of health, after NOT_SERVING), QueryPoints and reflection streams, and
  // calls that wait for a revision; accepts no more requests; cancels the requests that are still
  // in flight after `grace`; and waits until all have ended. Must be called at most once.
  void Shutdown(absl::Duration grace);

 private:
  explicit GrpcServer(const Facilities& facilities);

  // Tells the health service whether the server has room, its clock is right and its maps work, now
  // and every second from now on.
  void TellHealth();
  void TellHealthOfMaps();
  // Reads the identities again when they change, and ends the watches of those who have lost
  // access, now and every second from now on.
  void FollowAccess();
  // Opens maps that could not be opened before, now and every second, on a worker.
  void ReopenMaps();
  // Ends calls that were passed on to servers that are not the owners of their maps any more, now
  // and every second. REQUIRES: there is a forwarder.
  void FollowOwners();
  // Removes old deleted maps for good, now and every ten seconds, on a worker.
  void RemoveOldTrash();
  // Shuts down the connections soon after the last call has ended. REQUIRES: the listener stopped.
  void CloseWhenIdle();

  AccessService access_service_;
  CatalogService catalog_;
  QueryService query_;
  EditService edit_;
  IngestService ingest_;
  ExplorationService exploration_;
  WatchService watch_;
  RobotService robots_;
  ServerService servers_;
  health::HealthService health_;
  reflection::ReflectionService reflection_;
  std::set<std::string> maps_with_health_;  // names for the health service; used by TellHealth only
  Site* const site_;
  Budgets* const budgets_;
  AccessControl* const access_;
  WorkerPools* const workers_;
  Forwarder* const forwarder_;
  std::unique_ptr<grpc::Server> server_;
  // Destroyed before the server, to which it gives connections.
  std::unique_ptr<admission::GrpcListener> listener_;
  // Destroyed before the members that its tasks use.
  TimerQueue timer_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_GRPC_SERVER_H_
