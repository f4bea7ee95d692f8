#include "server/services/edit_service.h"

#include <memory>
#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "wire/edit.h"

namespace hypermap::server {
namespace {

// Batches up to this size are decoded on gRPC's thread, in less time than a worker needs to wake
// up.
constexpr int kFewEdits = 16;
constexpr size_t kFewBytes = 16 << 10;

}  // namespace

grpc::ServerUnaryReactor* EditService::ApplyEdits(grpc::CallbackServerContext* context,
                                                  const v1::ApplyEditsRequest* request,
                                                  v1::ApplyEditsResponse* response) {
  auto call = std::make_shared<UnaryCall>(context, "ApplyEdits", request->map());
  const auto start = [this, call, request, response] {
    return StartEdits(call, *request, response);
  };
  if (request->edits_size() <= kFewEdits && request->ByteSizeLong() <= kFewBytes) {
    return StartAtOnce(call, start);
  }
  return StartOn(&facilities_.workers->writes, call, start);
}

absl::Status EditService::StartEdits(UnaryCallPtr call, const v1::ApplyEditsRequest& request,
                                     v1::ApplyEditsResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  HYPERMAP_ASSIGN_OR_RETURN(EditBatch batch,
                            wire::DecodeEdits(request.edits(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerVersion> if_layers,
                            wire::DecodeLayerVersions("if_layers", request.if_layers()));
  batch.if_layers = std::move(if_layers);
  response->set_map(request.map());
  SubmitAndFinish(std::move(call), *session, std::move(batch), request.request_id(),
                  [response](const storage::Receipt& receipt) {
                    response->set_revision(receipt.revision);
                    response->mutable_object_ids()->Assign(receipt.object_ids.begin(),
                                                           receipt.object_ids.end());
                  });
  return absl::OkStatus();
}

}  // namespace hypermap::server
