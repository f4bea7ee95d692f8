// The gRPC service hypermap.v1.EditService.
#ifndef HYPERMAP_SERVER_SERVICES_EDIT_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_EDIT_SERVICE_H_

#include "absl/status/status.h"
#include "hypermap/v1/edit_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

class EditService : public v1::EditService::CallbackService {
 public:
  explicit EditService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* ApplyEdits(grpc::CallbackServerContext* context,
                                       const v1::ApplyEditsRequest* request,
                                       v1::ApplyEditsResponse* response) override;

 private:
  absl::Status StartEdits(UnaryCallPtr call, const v1::ApplyEditsRequest& request,
                          v1::ApplyEditsResponse* response) const;

  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EDIT_SERVICE_H_
