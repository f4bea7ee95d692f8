#include "server/services/catalog_service.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/check_report.h"
#include "map/digest/content_digest.h"
#include "map/layers/layer_registry.h"
#include "server/rpc/call_context.h"
#include "server/rpc/map_message.h"
#include "server/rpc/request_digest.h"
#include "server/rpc/streamed_answer.h"
#include "server/services/backup_source.h"
#include "server/services/export_source.h"
#include "server/services/import_call.h"
#include "server/services/restore_call.h"
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
  broken.state = MapState::kClosed;
  wire::EncodeMapEntry(broken, message);
}

}  // namespace

template <typename Request, typename Response, typename Respond>
absl::Status CatalogService::SubmitEdit(const std::shared_ptr<UnaryCallOf<Request, Response>>& call,
                                        Edit edit, Respond respond) const {
  const Request& request = call->request();
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  EditBatch batch;
  batch.edits.push_back(std::move(edit));
  Response* const response = call->response();
  response->set_map(request.map());
  response->set_incarnation(session->incarnation());
  SubmitAndFinish(call, *session, std::move(batch), request.request_id(), DigestOf(request),
                  [response, respond = std::move(respond)](const storage::Receipt& receipt) {
                    response->set_revision(receipt.revision);
                    respond(receipt, response);
                  });
  return absl::OkStatus();
}

template <typename Request, typename Response, typename Fill>
grpc::ServerUnaryReactor* CatalogService::AnswerFromSnapshot(grpc::CallbackServerContext* context,
                                                             Rpc rpc, const RawMessages& raw,
                                                             Fill fill) const {
  const auto call = BeginCall<Request, Response>(facilities_.for_calls(), context, rpc, raw);
  return AnswerOn(&facilities_.workers->questions, call,
                  [this, call, fill]() -> absl::StatusOr<int64_t> {
                    const Request& request = call->request();
                    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                                              FindMap(facilities_, request.map()));
                    const SnapshotPtr snapshot = session->snapshot();
                    Response* const response = call->response();
                    response->set_map(request.map());
                    response->set_revision(snapshot->revision);
                    response->set_incarnation(session->incarnation());
                    return fill(*call, *snapshot, response);
                  });
}

grpc::ServerUnaryReactor* CatalogService::CreateMap(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request,
                                                    grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::CreateMapRequest, v1::CreateMapResponse>(
      facilities_.for_calls(), context, Rpc::kCreateMap, {request, response});
  return AnswerOn(&facilities_.workers->openings, call, [this, call]() -> absl::StatusOr<int64_t> {
    HYPERMAP_RETURN_IF_ERROR(MakeMap(call->context(), call->request(), call->response()));
    return 1;
  });
}

absl::Status CatalogService::MakeMap(const CallContext& context,
                                     const v1::CreateMapRequest& request,
                                     v1::CreateMapResponse* response) const {
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  const std::string frame = request.frame_id().empty() ? kDefaultFrame : request.frame_id();
  const absl::StatusOr<std::shared_ptr<MapSession>> session =
      facilities_.site->Create({request.map(), frame, request.request_id()});
  if (!session.ok()) return session.status();
  EncodeMap(**session, response->mutable_map());
  context.Edited(response->map().revision(), request.request_id(), /*edits=*/0);
  return absl::OkStatus();
}

grpc::ServerUnaryReactor* CatalogService::GetMap(grpc::CallbackServerContext* context,
                                                 const grpc::ByteBuffer* request,
                                                 grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::GetMapRequest, v1::GetMapResponse>(
      facilities_.for_calls(), context, Rpc::kGetMap, {request, response});
  return AnswerOn(&facilities_.workers->questions, call, [this, call]() -> absl::StatusOr<int64_t> {
    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                              FindMap(facilities_, call->request().map()));
    EncodeMap(*session, call->response()->mutable_map());
    return 1;
  });
}

grpc::ServerUnaryReactor* CatalogService::ListMaps(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request,
                                                   grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ListMapsRequest, v1::ListMapsResponse>(
      facilities_.for_calls(), context, Rpc::kListMaps, {request, response});
  return AnswerOn(&facilities_.workers->questions, call, [this, call]() -> absl::StatusOr<int64_t> {
    v1::ListMapsResponse* const answer = call->response();
    for (const Site::Entry& entry : facilities_.site->List()) {
      if (call->context().caller().MaySee(entry.name)) EncodeEntry(entry, answer->add_maps());
    }
    return answer->maps_size();
  });
}

grpc::ServerUnaryReactor* CatalogService::DeleteMap(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request,
                                                    grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::DeleteMapRequest, v1::DeleteMapResponse>(
      facilities_.for_calls(), context, Rpc::kDeleteMap, {request, response});
  // It waits until the map's writer has finished what it has accepted.
  return AnswerOn(
      &facilities_.workers->openings, call,
      [this, call]() -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(RemoveMap(call->context(), call->request()));
        call->response()->set_map(call->request().map());
        return 1;
      },
      Turns::kOnePerMap);
}

absl::Status CatalogService::RemoveMap(const CallContext& context,
                                       const v1::DeleteMapRequest& request) const {
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  absl::Status status =
      facilities_.site->Delete(request.map(), request.request_id(), request.incarnation());
  if (status.ok()) context.Edited(/*revision=*/0, request.request_id(), /*edits=*/0);
  return status;
}

grpc::ServerUnaryReactor* CatalogService::CreateLayer(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request,
                                                      grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::CreateLayerRequest, v1::CreateLayerResponse>(
      facilities_.for_calls(), context, Rpc::kCreateLayer, {request, response},
      CheckRequestSize(*request, FixedLimits::kMaxLayerRequestBytes));
  WorkerPools& workers = *facilities_.workers;
  WorkerPool& pool = call->is_parsed() ? workers.writes : workers.long_writes;
  return StartOn(&pool, call, [this, call]() -> absl::Status {
    const v1::CreateLayerRequest& asked = call->request();
    if (!asked.has_layer()) return absl::InvalidArgumentError("layer is missing");
    HYPERMAP_ASSIGN_OR_RETURN(const LayerSpec spec, wire::DecodeLayerSpec("layer", asked.layer()));
    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                              FindMap(facilities_, asked.map(), asked.incarnation()));
    // The answer is the layer as this request creates it, also for a retry that comes after the
    // layer was changed.
    LayerSpec made = spec;
    if (made.frame_id.empty()) made.frame_id = session->header().frame_id;
    return SubmitEdit(call, hypermap::CreateLayer{spec},
                      [made](const storage::Receipt& receipt, v1::CreateLayerResponse* answer) {
                        wire::EncodeLayer(*MakeEmptyLayer(made), answer->mutable_layer(),
                                          receipt.revision);
                      });
  });
}

grpc::ServerUnaryReactor* CatalogService::GetLayer(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request,
                                                   grpc::ByteBuffer* response) {
  return AnswerFromSnapshot<v1::GetLayerRequest, v1::GetLayerResponse>(
      context, Rpc::kGetLayer, {request, response},
      [](auto& call, const Snapshot& snapshot,
         v1::GetLayerResponse* answer) -> absl::StatusOr<int64_t> {
        const std::string& name = call.request().layer();
        const Revision version = snapshot.LayerVersionOf(name);
        if (const auto damaged = snapshot.damaged.find(name); damaged != snapshot.damaged.end()) {
          wire::EncodeLayer(damaged->second, answer->mutable_layer(), version);
          return 1;
        }
        HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot.GetLayer(name));
        wire::EncodeLayer(*layer, answer->mutable_layer(), version);
        HYPERMAP_RETURN_IF_ERROR(ReservePart(call, answer->layer()));
        return 1;
      });
}

grpc::ServerUnaryReactor* CatalogService::ListLayers(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request,
                                                     grpc::ByteBuffer* response) {
  return AnswerFromSnapshot<v1::ListLayersRequest, v1::ListLayersResponse>(
      context, Rpc::kListLayers, {request, response},
      [](auto& call, const Snapshot& snapshot,
         v1::ListLayersResponse* answer) -> absl::StatusOr<int64_t> {
        for (const auto& [name, layer] : snapshot.layers) {
          v1::Layer* const encoded = answer->add_layers();
          wire::EncodeLayer(*layer, encoded, snapshot.LayerVersionOf(name));
          HYPERMAP_RETURN_IF_ERROR(ReservePart(call, *encoded));
        }
        for (const auto& [name, layer] : snapshot.damaged) {
          wire::EncodeLayer(layer, answer->add_layers(), snapshot.LayerVersionOf(name));
        }
        return answer->layers_size();
      });
}

grpc::ServerUnaryReactor* CatalogService::DeleteLayer(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request,
                                                      grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::DeleteLayerRequest, v1::DeleteLayerResponse>(
      facilities_.for_calls(), context, Rpc::kDeleteLayer, {request, response});
  return StartOn(&facilities_.workers->writes, call, [this, call]() -> absl::Status {
    return SubmitEdit(call, hypermap::DeleteLayer{call->request().layer()},
                      [](const storage::Receipt&, v1::DeleteLayerResponse*) {});
  });
}

grpc::ServerUnaryReactor* CatalogService::SetTransform(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request,
                                                       grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::SetTransformRequest, v1::SetTransformResponse>(
      facilities_.for_calls(), context, Rpc::kSetTransform, {request, response});
  return StartOn(&facilities_.workers->writes, call, [this, call]() -> absl::Status {
    if (!call->request().has_transform()) return absl::InvalidArgumentError("transform is missing");
    HYPERMAP_ASSIGN_OR_RETURN(FrameTransform transform,
                              wire::DecodeTransform("transform", call->request().transform()));
    return SubmitEdit(call, hypermap::SetTransform{std::move(transform)},
                      [](const storage::Receipt&, v1::SetTransformResponse*) {});
  });
}

grpc::ServerUnaryReactor* CatalogService::ListTransforms(grpc::CallbackServerContext* context,
                                                         const grpc::ByteBuffer* request,
                                                         grpc::ByteBuffer* response) {
  return AnswerFromSnapshot<v1::ListTransformsRequest, v1::ListTransformsResponse>(
      context, Rpc::kListTransforms, {request, response},
      [](auto& call, const Snapshot& snapshot,
         v1::ListTransformsResponse* answer) -> absl::StatusOr<int64_t> {
        answer->set_frame_id(snapshot.frame_id);
        for (const FrameTransform& transform : snapshot.frames.transforms()) {
          v1::Transform* const encoded = answer->add_transforms();
          wire::EncodeTransform(transform, encoded);
          HYPERMAP_RETURN_IF_ERROR(ReservePart(call, *encoded));
        }
        return answer->transforms_size();
      });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* CatalogService::ImportMap(
    grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
  return new ImportCall(context, &facilities_, response);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* CatalogService::ExportMap(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  WorkerPool* const files = &facilities_.workers->files;
  auto* const answer = new StreamedAnswer<v1::ExportMapRequest, v1::ExportMapResponse>(
      facilities_.for_calls(), context, Rpc::kExportMap, *request, files, files,
      [this](const v1::ExportMapRequest& asked, absl::string_view client) {
        return OpenExport(facilities_, client, asked);
      },
      CheckRequestSize(*request, FixedLimits::kMaxRequestBytes));
  answer->BeginOnWorker();
  return answer;
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* CatalogService::BackupMap(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  WorkerPool* const files = &facilities_.workers->files;
  auto* const answer = new StreamedAnswer<v1::BackupMapRequest, v1::BackupMapResponse>(
      facilities_.for_calls(), context, Rpc::kBackupMap, *request, files, files,
      [this](const v1::BackupMapRequest& asked, absl::string_view client) {
        return OpenBackup(facilities_, client, asked);
      },
      CheckRequestSize(*request, FixedLimits::kMaxRequestBytes));
  answer->BeginOnWorker();
  return answer;
}

grpc::ServerUnaryReactor* CatalogService::CheckMap(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request,
                                                   grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::CheckMapRequest, v1::CheckMapResponse>(
      facilities_.for_calls(), context, Rpc::kCheckMap, {request, response});
  return AnswerOn(&facilities_.workers->files, call, [this, call]() -> absl::StatusOr<int64_t> {
    const std::string& map = call->request().map();
    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session, FindMap(facilities_, map));
    HYPERMAP_ASSIGN_OR_RETURN(const CheckReport report, session->Check());
    v1::CheckMapResponse* const answer = call->response();
    answer->set_map(map);
    answer->set_revision(report.revision);
    answer->set_incarnation(session->incarnation());
    answer->set_more(report.more);
    for (const Finding& finding : report.findings) {
      v1::Finding* const encoded = answer->add_findings();
      wire::EncodeFinding(finding, encoded);
      HYPERMAP_RETURN_IF_ERROR(ReservePart(*call, *encoded));
    }
    return answer->findings_size();
  });
}

grpc::ServerUnaryReactor* CatalogService::DigestMap(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request,
                                                    grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::DigestMapRequest, v1::DigestMapResponse>(
      facilities_.for_calls(), context, Rpc::kDigestMap, {request, response});
  return AnswerOn(&facilities_.workers->long_questions, call,
                  [this, call]() -> absl::StatusOr<int64_t> {
                    const std::string& map = call->request().map();
                    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                                              FindMap(facilities_, map));
                    const SnapshotPtr snapshot = session->snapshot();
                    const ContentDigest digest = DigestOf(*snapshot);
                    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
                    v1::DigestMapResponse* const answer = call->response();
                    answer->set_map(map);
                    answer->set_incarnation(session->incarnation());
                    wire::EncodeContentDigest(digest, snapshot->layer_versions, answer);
                    return answer->layers_size();
                  });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* CatalogService::RestoreMap(
    grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
  return new RestoreCall(context, &facilities_, response);
}

}  // namespace hypermap::server
