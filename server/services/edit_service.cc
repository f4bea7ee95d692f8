#include "server/services/edit_service.h"

#include <memory>
#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "server/rpc/request_digest.h"
#include "wire/edit.h"

namespace hypermap::server {
namespace {

// Batches up to this size are decoded on gRPC's thread, in less time than a worker needs to wake
// up, unless their bytes are many.
constexpr int kFewEdits = 16;

}  // namespace

grpc::ServerUnaryReactor* EditService::ApplyEdits(grpc::CallbackServerContext* context,
                                                  const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ApplyEditsRequest, v1::ApplyEditsResponse>(
      facilities_.for_calls(), context, Rpc::kApplyEdits, {request, response},
      /*acceptable=*/absl::OkStatus());
  const auto start = [this, call] { return StartEdits(call); };
  if (!call->is_parsed()) return StartOn(&facilities_.workers->long_writes, call, start);
  if (call->request().edits_size() <= kFewEdits) return StartAtOnce(call, start);
  return StartOn(&facilities_.workers->writes, call, start);
}

absl::Status EditService::StartEdits(const std::shared_ptr<EditsCall>& call) const {
  const v1::ApplyEditsRequest& request = call->request();
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  HYPERMAP_ASSIGN_OR_RETURN(EditBatch batch,
                            wire::DecodeEdits(request.edits(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerVersion> if_layers,
                            wire::DecodeLayerVersions("if_layers", request.if_layers()));
  batch.if_layers = std::move(if_layers);
  v1::ApplyEditsResponse* const response = call->response();
  response->set_map(request.map());
  response->set_incarnation(session->incarnation());
  SubmitAndFinish(call, *session, std::move(batch), request.request_id(), DigestOf(request),
                  [response](const storage::Receipt& receipt) {
                    response->set_revision(receipt.revision);
                    response->mutable_object_ids()->Assign(receipt.object_ids.begin(),
                                                           receipt.object_ids.end());
                  });
  return absl::OkStatus();
}

}  // namespace hypermap::server
