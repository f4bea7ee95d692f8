#include "server/services/edit_service.h"

#include <memory>
#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/request_digest.h"
#include "wire/edit.h"

namespace hypermap::server {
namespace {

// Batches up to this size are decoded on gRPC's thread, in less time than a worker needs to wake
// up.
constexpr int kFewEdits = 16;
constexpr size_t kFewBytes = 16 << 10;

}  // namespace

// One ApplyEdits rpc.
struct EditService::EditsCall {
  UnaryCallPtr call;
  // The encoded request until it is parsed, and where the encoded response belongs; they live until
  // the call is finished.
  const grpc::ByteBuffer* encoded_request;
  grpc::ByteBuffer* encoded_response;
  v1::ApplyEditsRequest request;

  absl::Status Parse() {
    HYPERMAP_RETURN_IF_ERROR(ParseRequest(*encoded_request, &request));
    call->set_map(request.map());
    return absl::OkStatus();
  }
};

grpc::ServerUnaryReactor* EditService::ApplyEdits(grpc::CallbackServerContext* context,
                                                  const grpc::ByteBuffer* request,
                                                  grpc::ByteBuffer* response) {
  auto call = std::make_shared<UnaryCall>(facilities_.budgets, context, "ApplyEdits", "");
  const size_t size = request->Length();
  absl::Status charged = call->admitted();
  if (charged.ok()) charged = call->ChargeRequest(static_cast<int64_t>(size));
  if (!charged.ok()) {
    call->Finish(charged);
    return call->reactor();
  }
  auto edits = std::make_shared<EditsCall>(EditsCall{call, request, response, {}});
  if (size > kFewBytes) {
    return StartOn(&facilities_.workers->long_writes, call, [this, edits]() -> absl::Status {
      HYPERMAP_RETURN_IF_ERROR(edits->Parse());
      return StartEdits(edits);
    });
  }
  absl::Status parsed = edits->Parse();
  const auto start = [this, edits, parsed = std::move(parsed)]() -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(parsed);
    return StartEdits(edits);
  };
  if (edits->request.edits_size() <= kFewEdits) return StartAtOnce(call, start);
  return StartOn(&facilities_.workers->writes, call, start);
}

absl::Status EditService::StartEdits(const std::shared_ptr<EditsCall>& edits) const {
  const v1::ApplyEditsRequest& request = edits->request;
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  HYPERMAP_ASSIGN_OR_RETURN(EditBatch batch,
                            wire::DecodeEdits(request.edits(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerVersion> if_layers,
                            wire::DecodeLayerVersions("if_layers", request.if_layers()));
  batch.if_layers = std::move(if_layers);
  v1::ApplyEditsResponse response;
  response.set_map(request.map());
  response.set_incarnation(session->incarnation());
  SubmitAndFinish(edits->call, *session, std::move(batch), request.request_id(), DigestOf(request),
                  [encoded = edits->encoded_response,
                   response = std::move(response)](const storage::Receipt& receipt) mutable {
                    response.set_revision(receipt.revision);
                    response.mutable_object_ids()->Assign(receipt.object_ids.begin(),
                                                          receipt.object_ids.end());
                    const grpc::Slice slice = Serialize(response);
                    grpc::ByteBuffer(&slice, 1).Swap(encoded);
                  });
  return absl::OkStatus();
}

}  // namespace hypermap::server
