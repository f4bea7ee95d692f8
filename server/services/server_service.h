// The gRPC service hypermap.v1.ServerService.
#ifndef HYPERMAP_SERVER_SERVICES_SERVER_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_SERVER_SERVICE_H_

#include "hypermap/v1/server_service.grpc.pb.h"
#include "server/rpc/facilities.h"

namespace hypermap::server {

// Thread safe.
class ServerService final
    : public v1::ServerService::WithRawCallbackMethod_ListServers<
          v1::ServerService::WithRawCallbackMethod_DrainServer<v1::ServerService::Service>> {
 public:
  explicit ServerService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* ListServers(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* DrainServer(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;

 private:
  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_SERVER_SERVICE_H_
