// The gRPC service hypermap.v1.AccessService.
#ifndef HYPERMAP_SERVER_SERVICES_ACCESS_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_ACCESS_SERVICE_H_

#include "hypermap/v1/access_service.grpc.pb.h"
#include "server/rpc/facilities.h"

namespace hypermap::server {

// Thread safe.
class AccessService final
    : public v1::AccessService::WithRawCallbackMethod_GetCaller<v1::AccessService::Service> {
 public:
  explicit AccessService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* GetCaller(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;

 private:
  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_ACCESS_SERVICE_H_
