// The gRPC service hypermap.v1.EditService.
#ifndef HYPERMAP_SERVER_SERVICES_EDIT_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_EDIT_SERVICE_H_

#include <grpcpp/support/byte_buffer.h>

#include <memory>

#include "absl/status/status.h"
#include "hypermap/v1/edit_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

// ApplyEdits is a raw method: a large request is charged, or refused, before it is decoded.
class EditService
    : public v1::EditService::WithRawCallbackMethod_ApplyEdits<v1::EditService::Service> {
 public:
  explicit EditService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* ApplyEdits(grpc::CallbackServerContext* context,
                                       const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override;

 private:
  using EditsCall = UnaryCallOf<v1::ApplyEditsRequest, v1::ApplyEditsResponse>;

  // Decodes and submits the edits.
  absl::Status StartEdits(const std::shared_ptr<EditsCall>& call) const;

  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EDIT_SERVICE_H_
