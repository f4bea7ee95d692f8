// The services behind one port.
#ifndef HYPERMAP_SERVER_SERVICES_GRPC_SERVER_H_
#define HYPERMAP_SERVER_SERVICES_GRPC_SERVER_H_

#include <grpcpp/server.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/tls/server_credentials.h"
#include "server/rpc/facilities.h"
#include "server/services/catalog_service.h"
#include "server/services/edit_service.h"
#include "server/services/exploration_service.h"
#include "server/services/ingest_service.h"
#include "server/services/query_service.h"
#include "server/watch/watch_service.h"

namespace hypermap::server {

struct GrpcServerOptions {
  // HOST:PORT; port 0 takes any that is free.
  std::string listen;
  // Of a message, either way.
  int max_message_bytes = 16 << 20;
  TlsFiles tls = {};
};

// Serves from Start to Shutdown: Hypermap's services, the standard health service (all of them
// SERVING until the shutdown begins) and reflection.
class GrpcServer {
 public:
  // What the facilities point to outlives the server. INVALID_ARGUMENT for an address that is none
  // or unfit TLS files, UNAVAILABLE when it can't be listened on.
  static absl::StatusOr<std::unique_ptr<GrpcServer>> Start(const GrpcServerOptions& options,
                                                           const Facilities& facilities);
  ~GrpcServer();
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;

  // HOST:PORT with the port that is served.
  const std::string& address() const { return address_; }

  // Ends watches, streams of batches and those who wait for a revision, takes no more requests,
  // gives those in flight `grace` to end, then cancels them, and waits until all have ended. Called
  // once at most.
  void Shutdown(absl::Duration grace);

 private:
  explicit GrpcServer(const Facilities& facilities);

  CatalogService catalog_;
  QueryService query_;
  EditService edit_;
  IngestService ingest_;
  ExplorationService exploration_;
  WatchService watch_;
  Site* const site_;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_GRPC_SERVER_H_
