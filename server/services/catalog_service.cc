#include "server/services/catalog_service.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "server/rpc/map_message.h"
#include "server/rpc/request_digest.h"
#include "server/rpc/request_log.h"
#include "server/rpc/streamed_answer.h"
#include "server/services/backup_source.h"
#include "server/services/export_source.h"
#include "server/services/import_call.h"
#include "wire/catalog.h"
#include "wire/geometry.h"
#include "wire/layer.h"

namespace hypermap::server {
namespace {

constexpr char kDefaultFrame[] = "map";

void EncodeEntry(const Site::Entry& entry, v1::Map* message) {
  if (entry.session) return EncodeMap(*entry.session, message);
  MapEntry broken;
  broken.name = entry.name;
  broken.problem = entry.problem.ToString();
  wire::EncodeMapEntry(broken, message);
}

}  // namespace

template <typename Request, typename Response, typename Respond>
absl::Status CatalogService::SubmitEdit(UnaryCallPtr call, const Request& request,
                                        Response* response, Edit edit, Respond respond) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  EditBatch batch;
  batch.edits.push_back(std::move(edit));
  response->set_map(request.map());
  response->set_incarnation(session->incarnation());
  SubmitAndFinish(std::move(call), *session, std::move(batch), request.request_id(),
                  DigestOf(request), std::move(respond));
  return absl::OkStatus();
}

template <typename Request, typename Response, typename Fill>
grpc::ServerUnaryReactor* CatalogService::AnswerFromSnapshot(grpc::CallbackServerContext* context,
                                                             absl::string_view rpc,
                                                             const Request* request,
                                                             Response* response, Fill fill) const {
  auto call = std::make_shared<UnaryCall>(facilities_.budgets, context, rpc, request->map());
  return AnswerOn(&facilities_.workers->questions, std::move(call),
                  [this, request, response, fill]() -> absl::StatusOr<int64_t> {
                    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                                              FindMap(facilities_, request->map()));
                    const SnapshotPtr snapshot = session->snapshot();
                    response->set_map(request->map());
                    response->set_revision(snapshot->revision);
                    response->set_incarnation(session->incarnation());
                    return fill(*snapshot);
                  });
}

grpc::ServerUnaryReactor* CatalogService::CreateMap(grpc::CallbackServerContext* context,
                                                    const v1::CreateMapRequest* request,
                                                    v1::CreateMapResponse* response) {
  auto call =
      std::make_shared<UnaryCall>(facilities_.budgets, context, "CreateMap", request->map());
  return AnswerOn(&facilities_.workers->openings, call,
                  [this, call, request, response]() -> absl::StatusOr<int64_t> {
                    absl::Status status = MakeMap(call->log(), *request, response);
                    if (!status.ok()) return status;
                    return 1;
                  });
}

absl::Status CatalogService::MakeMap(const RequestLog& log, const v1::CreateMapRequest& request,
                                     v1::CreateMapResponse* response) const {
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  const std::string frame = request.frame_id().empty() ? kDefaultFrame : request.frame_id();
  const absl::StatusOr<std::shared_ptr<MapSession>> session =
      facilities_.site->Create({request.map(), frame, request.request_id()});
  if (!session.ok()) return session.status();
  EncodeMap(**session, response->mutable_map());
  log.Edited(response->map().revision(), request.request_id(), /*edits=*/0);
  return absl::OkStatus();
}

grpc::ServerUnaryReactor* CatalogService::GetMap(grpc::CallbackServerContext* context,
                                                 const v1::GetMapRequest* request,
                                                 v1::GetMapResponse* response) {
  auto call = std::make_shared<UnaryCall>(facilities_.budgets, context, "GetMap", request->map());
  return AnswerOn(&facilities_.workers->questions, std::move(call),
                  [this, request, response]() -> absl::StatusOr<int64_t> {
                    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                                              FindMap(facilities_, request->map()));
                    EncodeMap(*session, response->mutable_map());
                    return 1;
                  });
}

grpc::ServerUnaryReactor* CatalogService::ListMaps(grpc::CallbackServerContext* context,
                                                   const v1::ListMapsRequest*,
                                                   v1::ListMapsResponse* response) {
  auto call = std::make_shared<UnaryCall>(facilities_.budgets, context, "ListMaps", "");
  return AnswerOn(&facilities_.workers->questions, std::move(call),
                  [this, response]() -> absl::StatusOr<int64_t> {
                    for (const Site::Entry& entry : facilities_.site->List()) {
                      EncodeEntry(entry, response->add_maps());
                    }
                    return response->maps_size();
                  });
}

grpc::ServerUnaryReactor* CatalogService::DeleteMap(grpc::CallbackServerContext* context,
                                                    const v1::DeleteMapRequest* request,
                                                    v1::DeleteMapResponse* response) {
  auto call =
      std::make_shared<UnaryCall>(facilities_.budgets, context, "DeleteMap", request->map());
  return AnswerOn(&facilities_.workers->openings, call,
                  [this, call, request, response]() -> absl::StatusOr<int64_t> {
                    absl::Status status = RemoveMap(call->log(), *request);
                    if (!status.ok()) return status;
                    response->set_map(request->map());
                    return 1;
                  });
}

absl::Status CatalogService::RemoveMap(const RequestLog& log,
                                       const v1::DeleteMapRequest& request) const {
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  absl::Status status =
      facilities_.site->Delete(request.map(), request.request_id(), request.incarnation());
  if (status.ok()) log.Edited(/*revision=*/0, request.request_id(), /*edits=*/0);
  return status;
}

grpc::ServerUnaryReactor* CatalogService::CreateLayer(grpc::CallbackServerContext* context,
                                                      const v1::CreateLayerRequest* request,
                                                      v1::CreateLayerResponse* response) {
  auto call =
      std::make_shared<UnaryCall>(facilities_.budgets, context, "CreateLayer", request->map());
  return StartOn(&facilities_.workers->writes, call, [this, call, request, response] {
    return StartCreateLayer(call, *request, response);
  });
}

absl::Status CatalogService::StartCreateLayer(UnaryCallPtr call,
                                              const v1::CreateLayerRequest& request,
                                              v1::CreateLayerResponse* response) const {
  if (!request.has_layer()) return absl::InvalidArgumentError("layer is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const LayerSpec spec, wire::DecodeLayerSpec("layer", request.layer()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  // The answer is the layer as this request creates it, also for a retry that comes after the layer
  // was changed.
  LayerSpec made = spec;
  if (made.frame_id.empty()) made.frame_id = session->header().frame_id;
  return SubmitEdit(std::move(call), request, response, hypermap::CreateLayer{spec},
                    [response, made](const storage::Receipt& receipt) {
                      response->set_revision(receipt.revision);
                      wire::EncodeLayer(*MakeEmptyLayer(made), response->mutable_layer(),
                                        receipt.revision);
                    });
}

grpc::ServerUnaryReactor* CatalogService::GetLayer(grpc::CallbackServerContext* context,
                                                   const v1::GetLayerRequest* request,
                                                   v1::GetLayerResponse* response) {
  return AnswerFromSnapshot(
      context, "GetLayer", request, response,
      [request, response](const Snapshot& snapshot) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot.GetLayer(request->layer()));
        wire::EncodeLayer(*layer, response->mutable_layer(),
                          snapshot.LayerVersionOf(request->layer()));
        return 1;
      });
}

grpc::ServerUnaryReactor* CatalogService::ListLayers(grpc::CallbackServerContext* context,
                                                     const v1::ListLayersRequest* request,
                                                     v1::ListLayersResponse* response) {
  return AnswerFromSnapshot(context, "ListLayers", request, response,
                            [response](const Snapshot& snapshot) -> absl::StatusOr<int64_t> {
                              for (const auto& [name, layer] : snapshot.layers) {
                                wire::EncodeLayer(*layer, response->add_layers(),
                                                  snapshot.LayerVersionOf(name));
                              }
                              return response->layers_size();
                            });
}

grpc::ServerUnaryReactor* CatalogService::DeleteLayer(grpc::CallbackServerContext* context,
                                                      const v1::DeleteLayerRequest* request,
                                                      v1::DeleteLayerResponse* response) {
  auto call =
      std::make_shared<UnaryCall>(facilities_.budgets, context, "DeleteLayer", request->map());
  return StartOn(&facilities_.workers->writes, call, [this, call, request, response] {
    return SubmitEdit(
        call, *request, response, hypermap::DeleteLayer{request->layer()},
        [response](const storage::Receipt& receipt) { response->set_revision(receipt.revision); });
  });
}

grpc::ServerUnaryReactor* CatalogService::SetTransform(grpc::CallbackServerContext* context,
                                                       const v1::SetTransformRequest* request,
                                                       v1::SetTransformResponse* response) {
  auto call =
      std::make_shared<UnaryCall>(facilities_.budgets, context, "SetTransform", request->map());
  return StartOn(&facilities_.workers->writes, call, [this, call, request, response] {
    return StartSetTransform(call, *request, response);
  });
}

absl::Status CatalogService::StartSetTransform(UnaryCallPtr call,
                                               const v1::SetTransformRequest& request,
                                               v1::SetTransformResponse* response) const {
  if (!request.has_transform()) return absl::InvalidArgumentError("transform is missing");
  HYPERMAP_ASSIGN_OR_RETURN(FrameTransform transform,
                            wire::DecodeTransform("transform", request.transform()));
  return SubmitEdit(
      std::move(call), request, response, hypermap::SetTransform{std::move(transform)},
      [response](const storage::Receipt& receipt) { response->set_revision(receipt.revision); });
}

grpc::ServerUnaryReactor* CatalogService::ListTransforms(grpc::CallbackServerContext* context,
                                                         const v1::ListTransformsRequest* request,
                                                         v1::ListTransformsResponse* response) {
  return AnswerFromSnapshot(context, "ListTransforms", request, response,
                            [response](const Snapshot& snapshot) -> absl::StatusOr<int64_t> {
                              response->set_frame_id(snapshot.frame_id);
                              for (const FrameTransform& transform : snapshot.frames.transforms()) {
                                wire::EncodeTransform(transform, response->add_transforms());
                              }
                              return response->transforms_size();
                            });
}

grpc::ServerReadReactor<v1::ImportMapRequest>* CatalogService::ImportMap(
    grpc::CallbackServerContext* context, v1::ImportMapResponse* response) {
  return new ImportCall(context, &facilities_, response);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* CatalogService::ExportMap(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  WorkerPool* const files = &facilities_.workers->files;
  auto* const answer = new StreamedAnswer<v1::ExportMapRequest, v1::ExportMapResponse>(
      facilities_.budgets, context, "ExportMap", *request, files, files,
      [this, client = context->peer()](const v1::ExportMapRequest& asked) {
        return OpenExport(facilities_, client, asked);
      });
  answer->BeginOnWorker();
  return answer;
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* CatalogService::BackupMap(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  WorkerPool* const files = &facilities_.workers->files;
  auto* const answer = new StreamedAnswer<v1::BackupMapRequest, v1::BackupMapResponse>(
      facilities_.budgets, context, "BackupMap", *request, files, files,
      [this, client = context->peer()](const v1::BackupMapRequest& asked) {
        return OpenBackup(facilities_, client, asked);
      });
  answer->BeginOnWorker();
  return answer;
}

}  // namespace hypermap::server
