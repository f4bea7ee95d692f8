#include "server/services/ingest_service.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "server/rpc/request_digest.h"
#include "server/services/observe_call.h"
#include "server/session/object_history.h"
#include "server/session/pose_smoothing.h"
#include "server/session/same_request.h"
#include "wire/ingest.h"
#include "wire/observation.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

// Hands a command to the map's writer, which ends the call when the result is on disk.
template <typename Request, typename Response>
absl::Status StartCommand(const Facilities& facilities, UnaryCallPtr call, const Request& request,
                          FusionCommand command, Response* response) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities, request.map(), request.incarnation()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  HYPERMAP_ASSIGN_OR_RETURN(std::string author, call->context().author());
  FusionSubmission submission{std::move(command), std::move(author), request.request_id(),
                              DigestOf(request)};
  submission.cancellation = call->MakeCancellation();
  submission.client = call->ticket().client();
  response->set_map(request.map());
  response->set_incarnation(session->incarnation());
  session->Run(std::move(submission), [call = std::move(call), request_id = request.request_id(),
                                       response](absl::StatusOr<storage::Receipt> receipt) {
    if (receipt.ok()) {
      call->context().Edited(receipt->revision, request_id, 1);
      response->set_revision(receipt->revision);
    }
    call->Finish(receipt.status());
  });
  return absl::OkStatus();
}

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* IngestService::Observe(
    grpc::CallbackServerContext* context) {
  return new ObserveCall(context, &facilities_, &observe_calls_);
}

grpc::ServerUnaryReactor* IngestService::RebuildLayer(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request,
                                                      grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::RebuildLayerRequest, v1::RebuildLayerResponse>(
      facilities_.for_calls(), context, Rpc::kRebuildLayer, {request, response});
  return StartOn(&facilities_.workers->writes, call, [this, call] {
    const v1::RebuildLayerRequest& request = call->request();
    return StartCommand(facilities_, call, request,
                        RebuildFusion{request.layer(), request.strategy(), request.parameters()},
                        call->response());
  });
}

grpc::ServerUnaryReactor* IngestService::RetractSource(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request,
                                                       grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::RetractSourceRequest, v1::RetractSourceResponse>(
      facilities_.for_calls(), context, Rpc::kRetractSource, {request, response});
  return StartOn(&facilities_.workers->writes, call, [this, call] {
    const v1::RetractSourceRequest& request = call->request();
    HYPERMAP_RETURN_IF_ERROR(call->context().caller().CheckRobot(request.robot()));
    RetractObservations command{request.layer(), request.robot()};
    if (request.has_from()) command.from = wire::DecodeTime(request.from());
    if (request.has_to()) command.to = wire::DecodeTime(request.to());
    return StartCommand(facilities_, call, request, std::move(command), call->response());
  });
}

grpc::ServerUnaryReactor* IngestService::CorrectPoses(grpc::CallbackServerContext* context,
                                                      const grpc::ByteBuffer* request,
                                                      grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::CorrectPosesRequest, v1::CorrectPosesResponse>(
      facilities_.for_calls(), context, Rpc::kCorrectPoses, {request, response});
  return StartOn(&facilities_.workers->writes, call, [this, call] {
    const v1::CorrectPosesRequest& request = call->request();
    HYPERMAP_RETURN_IF_ERROR(call->context().caller().CheckRobot(request.robot()));
    PoseCorrection correction{request.robot(), {}};
    HYPERMAP_ASSIGN_OR_RETURN(correction.poses, wire::DecodeCorrectedPoses(request.poses()));
    HYPERMAP_RETURN_IF_ERROR(Validate(correction));
    return StartCommand(
        facilities_, call, request,
        server::CorrectPoses{request.layer(), request.frame_id(), {std::move(correction)}},
        call->response());
  });
}

grpc::ServerUnaryReactor* IngestService::SmoothPoses(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request,
                                                     grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::SmoothPosesRequest, v1::SmoothPosesResponse>(
      facilities_.for_calls(), context, Rpc::kSmoothPoses, {request, response});
  // It reads a whole log, and waits for the map's writer.
  return AnswerOn(
      &facilities_.workers->long_questions, call,
      [this, call] { return Smooth(*call, call->request(), call->response()); }, Turns::kOnePerMap);
}

absl::StatusOr<int64_t> IngestService::Smooth(UnaryCall& call,
                                              const v1::SmoothPosesRequest& request,
                                              v1::SmoothPosesResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map(), request.incarnation()));
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  const std::string digest = DigestOf(request);
  std::optional<storage::Receipt> earlier;
  if (!request.request_id().empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(earlier, session->FindReceipt(request.request_id()));
    if (earlier) HYPERMAP_RETURN_IF_ERROR(CheckSameRequest(*earlier, digest));
  }
  response->set_map(request.map());
  response->set_incarnation(session->incarnation());
  if (earlier) {
    response->set_revision(earlier->revision);
    return 0;
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      SmoothedPoses smoothed,
      server::SmoothPoses(*session, request.layer(), request.occupancy_layer(),
                          [&call] { return call.CheckWanted(); }));
  response->set_revision(session->snapshot()->revision);
  response->set_matched(smoothed.matched);
  response->set_moved(smoothed.moved);
  response->set_rms_shift_m(smoothed.rms_shift_m);
  response->set_occupancy_layer(smoothed.occupancy_layer);
  if (smoothed.corrections.empty()) return 0;
  HYPERMAP_ASSIGN_OR_RETURN(std::string author, call.context().author());
  FusionSubmission submission{server::CorrectPoses{request.layer(), std::move(smoothed.frame_id),
                                                   std::move(smoothed.corrections)},
                              std::move(author), request.request_id(), digest};
  submission.client = call.ticket().client();
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                            session->RunAndWait(std::move(submission)));
  call.context().Edited(receipt.revision, request.request_id(), 1);
  response->set_revision(receipt.revision);
  return smoothed.moved;
}

grpc::ServerUnaryReactor* IngestService::ExplainObject(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request,
                                                       grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ExplainObjectRequest, v1::ExplainObjectResponse>(
      facilities_.for_calls(), context, Rpc::kExplainObject, {request, response});
  // It folds a whole log, and waits for the map's writer.
  return AnswerOn(
      &facilities_.workers->long_questions, call,
      [this, call] { return Explain(*call, call->request(), call->response()); },
      Turns::kOnePerMap);
}

absl::StatusOr<int64_t> IngestService::Explain(const UnaryCall& call,
                                               const v1::ExplainObjectRequest& request,
                                               v1::ExplainObjectResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map()));
  HYPERMAP_ASSIGN_OR_RETURN(const ObjectHistory history,
                            server::ExplainObject(*session, request.layer(), request.object_id(),
                                                  [&call] { return call.CheckWanted(); }));
  wire::EncodeObjectHistory(history, response);
  return static_cast<int64_t>(history.events.size());
}

}  // namespace hypermap::server
