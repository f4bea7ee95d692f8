#include "server/services/exploration_service.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "server/exploration/exploration_calls.h"
#include "server/rpc/request_digest.h"
#include "wire/exploration.h"
#include "wire/exploration_requests.h"

namespace hypermap::server {
namespace {

// Logs the commit, if the call made one.
void LogEdits(const UnaryCall& call, const ExplorationAnswer& answer,
              const std::string& request_id = "") {
  if (answer.num_edits > 0) call.context().Edited(answer.revision, request_id, answer.num_edits);
}

}  // namespace

template <typename Request, typename Response, typename Answer>
grpc::ServerUnaryReactor* ExplorationService::AnswerFromExplorations(
    grpc::CallbackServerContext* context, Rpc rpc, const RawMessages& raw, Answer answer,
    bool takes_turns) {
  const auto call =
      BeginCall<Request, Response>(facilities_.for_calls(), context, rpc, raw,
                                   CheckQuestionSize(*raw.request, facilities_.limits));
  return AnswerOn(
      &facilities_.workers->explorations, call,
      [this, call, answer]() -> absl::StatusOr<int64_t> {
        const Request& request = call->request();
        HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                                  FindMap(facilities_, request.map()));
        Response* const response = call->response();
        response->set_map(request.map());
        response->set_incarnation(session->incarnation());
        return answer(*call, request, response, *explorations_.Of(session));
      },
      takes_turns ? Turns::kOnePerMap : Turns::kNone);
}

grpc::ServerUnaryReactor* ExplorationService::StartExploration(grpc::CallbackServerContext* context,
                                                               const grpc::ByteBuffer* request,
                                                               grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::StartExplorationRequest, v1::StartExplorationResponse>(
      context, Rpc::kStartExploration, {request, response},
      [this](UnaryCall& call, const v1::StartExplorationRequest& request,
             v1::StartExplorationResponse* response,
             MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
        HYPERMAP_ASSIGN_OR_RETURN(ExplorationStart start,
                                  wire::DecodeStart(request, facilities_.limits));
        HYPERMAP_ASSIGN_OR_RETURN(start.author, call.context().author());
        start.request_digest = DigestOf(request);
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationView view, explorations.Start(start));
        LogEdits(call, view, request.request_id());
        response->set_revision(view.revision);
        wire::EncodeExploration(ViewOf(view.objects, view.frame_from_layer),
                                response->mutable_exploration());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::GetExploration(grpc::CallbackServerContext* context,
                                                             const grpc::ByteBuffer* request,
                                                             grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::GetExplorationRequest, v1::GetExplorationResponse>(
      context, Rpc::kGetExploration, {request, response},
      [](UnaryCall&, const v1::GetExplorationRequest& request, v1::GetExplorationResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationReport report,
                                  explorations.Get(request.exploration_id(), request.frame_id()));
        response->set_revision(report.revision);
        response->set_frame_id(report.frame_id);
        wire::EncodeExploration(ViewOf(report.objects, report.frame_from_layer),
                                response->mutable_exploration());
        wire::EncodeProgress(report.progress, response->mutable_progress());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::ListExplorations(grpc::CallbackServerContext* context,
                                                               const grpc::ByteBuffer* request,
                                                               grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::ListExplorationsRequest, v1::ListExplorationsResponse>(
      context, Rpc::kListExplorations, {request, response},
      [](UnaryCall& call, const v1::ListExplorationsRequest& request,
         v1::ListExplorationsResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationList list,
                                  explorations.List(request.frame_id()));
        response->set_revision(list.revision);
        response->set_frame_id(list.frame_id);
        for (const ExplorationObjects& objects : list.explorations) {
          v1::Exploration* const encoded = response->add_explorations();
          wire::EncodeExploration(ViewOf(objects, list.frame_from_layer), encoded);
          HYPERMAP_RETURN_IF_ERROR(ReservePart(call, *encoded));
        }
        return response->explorations_size();
      },
      /*takes_turns=*/false);
}

grpc::ServerUnaryReactor* ExplorationService::ListFrontiers(grpc::CallbackServerContext* context,
                                                            const grpc::ByteBuffer* request,
                                                            grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::ListFrontiersRequest, v1::ListFrontiersResponse>(
      context, Rpc::kListFrontiers, {request, response},
      [](UnaryCall& call, const v1::ListFrontiersRequest& request,
         v1::ListFrontiersResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(
            const FrontierList list,
            explorations.ListFrontiers(request.exploration_id(), request.frame_id()));
        response->set_revision(list.revision);
        response->set_frame_id(list.frame_id);
        response->set_exploration_id(list.exploration_id);
        for (const Explorer::FrontierView& frontier : list.frontiers) {
          v1::Frontier* const encoded = response->add_frontiers();
          wire::EncodeFrontier(
              ViewOf(frontier, list.geometry, list.frame_from_floor, request.with_cells()),
              encoded);
          HYPERMAP_RETURN_IF_ERROR(ReservePart(call, *encoded));
        }
        return response->frontiers_size();
      });
}

grpc::ServerUnaryReactor* ExplorationService::ClaimGoal(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request,
                                                        grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::ClaimGoalRequest, v1::ClaimGoalResponse>(
      context, Rpc::kClaimGoal, {request, response},
      [](UnaryCall& call, const v1::ClaimGoalRequest& request, v1::ClaimGoalResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(call.context().caller().CheckRobot(request.robot()));
        HYPERMAP_ASSIGN_OR_RETURN(GoalClaim claim, wire::DecodeClaim(request));
        HYPERMAP_ASSIGN_OR_RETURN(claim.author, call.context().author());
        HYPERMAP_ASSIGN_OR_RETURN(const ClaimAnswer answer, explorations.Claim(claim));
        LogEdits(call, answer);
        response->set_revision(answer.revision);
        response->set_frame_id(answer.frame_id);
        ClaimResult result{answer.exploration_id, answer.state, answer.end_reason, std::nullopt};
        if (answer.goal) result.goal = ViewOf(*answer.goal, answer.frame_from_layer);
        wire::EncodeClaimResult(result, response);
        return answer.goal ? 1 : 0;
      });
}

grpc::ServerUnaryReactor* ExplorationService::RenewGoal(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request,
                                                        grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::RenewGoalRequest, v1::RenewGoalResponse>(
      context, Rpc::kRenewGoal, {request, response},
      [](UnaryCall& call, const v1::RenewGoalRequest& request, v1::RenewGoalResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(call.context().caller().CheckRobot(request.robot()));
        HYPERMAP_ASSIGN_OR_RETURN(GoalRenewal renewal, wire::DecodeRenewal(request));
        HYPERMAP_ASSIGN_OR_RETURN(renewal.author, call.context().author());
        HYPERMAP_ASSIGN_OR_RETURN(const GoalAnswer answer, explorations.Renew(renewal));
        LogEdits(call, answer);
        response->set_revision(answer.revision);
        wire::EncodeGoal(ViewOf(answer.goal, answer.frame_from_layer), response->mutable_goal());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::ReleaseGoal(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request,
                                                          grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::ReleaseGoalRequest, v1::ReleaseGoalResponse>(
      context, Rpc::kReleaseGoal, {request, response},
      [](UnaryCall& call, const v1::ReleaseGoalRequest& request, v1::ReleaseGoalResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_RETURN_IF_ERROR(call.context().caller().CheckRobot(request.robot()));
        HYPERMAP_ASSIGN_OR_RETURN(GoalRelease release, wire::DecodeRelease(request));
        HYPERMAP_ASSIGN_OR_RETURN(release.author, call.context().author());
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationAnswer answer, explorations.Release(release));
        LogEdits(call, answer);
        response->set_revision(answer.revision);
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::StopExploration(grpc::CallbackServerContext* context,
                                                              const grpc::ByteBuffer* request,
                                                              grpc::ByteBuffer* response) {
  return AnswerFromExplorations<v1::StopExplorationRequest, v1::StopExplorationResponse>(
      context, Rpc::kStopExploration, {request, response},
      [](UnaryCall& call, const v1::StopExplorationRequest& request,
         v1::StopExplorationResponse* response,
         MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const std::string author, call.context().author());
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationView view,
                                  explorations.Stop(request.exploration_id(), author));
        LogEdits(call, view);
        response->set_revision(view.revision);
        wire::EncodeExploration(ViewOf(view.objects, view.frame_from_layer),
                                response->mutable_exploration());
        return 1;
      });
}

}  // namespace hypermap::server
