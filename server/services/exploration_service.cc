#include "server/services/exploration_service.h"

#include <memory>
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "server/exploration/exploration_calls.h"
#include "wire/exploration.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

absl::StatusOr<absl::Duration> DecodeLease(bool has_lease,
                                           const google::protobuf::Duration& lease) {
  if (!has_lease) return kDefaultLease;
  return wire::DecodeDuration("lease", lease);
}

absl::StatusOr<ExplorationStart> DecodeStart(const v1::StartExplorationRequest& request,
                                             const wire::DecodeLimits& limits) {
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(request.request_id()));
  if (!request.has_area()) return absl::InvalidArgumentError("area is missing");
  HYPERMAP_ASSIGN_OR_RETURN(Polygon area, wire::DecodePolygon("area", request.area(), limits));
  HYPERMAP_ASSIGN_OR_RETURN(const CellRule rule,
                            wire::DecodeCellRule("explored_rule", request.explored_rule()));
  ExplorationStart start;
  start.area = std::move(area);
  start.frame_id = request.frame_id();
  start.occupancy_layer = request.occupancy_layer();
  start.exploration_layer = request.exploration_layer();
  start.explored_rule = rule;
  start.robot_radius_m = request.robot_radius_m();
  if (request.range_m() != 0.0) start.range_m = request.range_m();
  if (request.min_gain_cells() != 0) start.min_gain_cells = request.min_gain_cells();
  start.request_id = request.request_id();
  return start;
}

absl::StatusOr<GoalClaim> DecodeClaim(const v1::ClaimGoalRequest& request) {
  if (!request.has_pose()) return absl::InvalidArgumentError("pose is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform pose, wire::DecodePose("pose", request.pose()));
  HYPERMAP_ASSIGN_OR_RETURN(const absl::Duration lease,
                            DecodeLease(request.has_lease(), request.lease()));
  GoalClaim claim;
  claim.exploration_id = request.exploration_id();
  claim.robot = request.robot();
  claim.place = {pose.x(), pose.y()};
  claim.frame_id = request.frame_id();
  claim.lease = lease;
  return claim;
}

// Logs the commit, if the call made one.
void LogEdits(const UnaryCall& call, const ExplorationAnswer& answer,
              const std::string& request_id = "") {
  if (answer.num_edits > 0) call.log().Edited(answer.revision, request_id, answer.num_edits);
}

}  // namespace

template <typename Request, typename Response, typename Answer>
grpc::ServerUnaryReactor* ExplorationService::AnswerFromExplorations(
    grpc::CallbackServerContext* context, absl::string_view rpc, const Request* request,
    Response* response, Answer answer) {
  auto call = std::make_shared<UnaryCall>(context, rpc, request->map());
  return AnswerOn(facilities_.explorers, call,
                  [this, call, request, response, answer]() -> absl::StatusOr<int64_t> {
                    HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                                              FindMap(facilities_, request->map()));
                    response->set_map(request->map());
                    return answer(*call, *explorations_.Of(session));
                  });
}

grpc::ServerUnaryReactor* ExplorationService::StartExploration(
    grpc::CallbackServerContext* context, const v1::StartExplorationRequest* request,
    v1::StartExplorationResponse* response) {
  return AnswerFromExplorations(
      context, "StartExploration", request, response,
      [this, request, response](const UnaryCall& call,
                                MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(ExplorationStart start,
                                  DecodeStart(*request, facilities_.limits.decode));
        start.author = call.log().author();
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationView view, explorations.Start(start));
        LogEdits(call, view, request->request_id());
        response->set_revision(view.revision);
        wire::EncodeExploration(view.objects, view.frame_from_layer,
                                response->mutable_exploration());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::GetExploration(
    grpc::CallbackServerContext* context, const v1::GetExplorationRequest* request,
    v1::GetExplorationResponse* response) {
  return AnswerFromExplorations(
      context, "GetExploration", request, response,
      [request, response](const UnaryCall&,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationReport report,
                                  explorations.Get(request->exploration_id(), request->frame_id()));
        response->set_revision(report.revision);
        response->set_frame_id(report.frame_id);
        wire::EncodeExploration(report.objects, report.frame_from_layer,
                                response->mutable_exploration());
        const ExplorationProgress& progress = report.progress;
        wire::EncodeProgress(progress.cells, progress.cell_area_m2, progress.rate_m2_per_s,
                             response->mutable_progress());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::ListExplorations(
    grpc::CallbackServerContext* context, const v1::ListExplorationsRequest* request,
    v1::ListExplorationsResponse* response) {
  return AnswerFromExplorations(
      context, "ListExplorations", request, response,
      [request, response](const UnaryCall&,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationList list,
                                  explorations.List(request->frame_id()));
        response->set_revision(list.revision);
        response->set_frame_id(list.frame_id);
        for (const ExplorationObjects& objects : list.explorations) {
          wire::EncodeExploration(objects, list.frame_from_layer, response->add_explorations());
        }
        return response->explorations_size();
      });
}

grpc::ServerUnaryReactor* ExplorationService::ListFrontiers(grpc::CallbackServerContext* context,
                                                            const v1::ListFrontiersRequest* request,
                                                            v1::ListFrontiersResponse* response) {
  return AnswerFromExplorations(
      context, "ListFrontiers", request, response,
      [request, response](const UnaryCall&,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(
            const FrontierList list,
            explorations.ListFrontiers(request->exploration_id(), request->frame_id()));
        response->set_revision(list.revision);
        response->set_frame_id(list.frame_id);
        response->set_exploration_id(list.exploration_id);
        for (const Explorer::FrontierView& frontier : list.frontiers) {
          wire::EncodeFrontier(frontier, list.geometry, list.frame_from_floor,
                               request->with_cells(), response->add_frontiers());
        }
        return response->frontiers_size();
      });
}

grpc::ServerUnaryReactor* ExplorationService::ClaimGoal(grpc::CallbackServerContext* context,
                                                        const v1::ClaimGoalRequest* request,
                                                        v1::ClaimGoalResponse* response) {
  return AnswerFromExplorations(
      context, "ClaimGoal", request, response,
      [request, response](const UnaryCall& call,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(GoalClaim claim, DecodeClaim(*request));
        claim.author = call.log().author();
        HYPERMAP_ASSIGN_OR_RETURN(const ClaimAnswer answer, explorations.Claim(claim));
        LogEdits(call, answer);
        response->set_revision(answer.revision);
        response->set_frame_id(answer.frame_id);
        response->set_exploration_id(answer.exploration_id);
        response->set_state(wire::EncodeExplorationState(answer.state));
        response->set_end_reason(wire::EncodeEndReason(answer.end_reason));
        if (answer.goal) {
          wire::EncodeGoal(*answer.goal, answer.frame_from_layer, response->mutable_goal());
        }
        return answer.goal ? 1 : 0;
      });
}

grpc::ServerUnaryReactor* ExplorationService::RenewGoal(grpc::CallbackServerContext* context,
                                                        const v1::RenewGoalRequest* request,
                                                        v1::RenewGoalResponse* response) {
  return AnswerFromExplorations(
      context, "RenewGoal", request, response,
      [request, response](const UnaryCall& call,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const absl::Duration lease,
                                  DecodeLease(request->has_lease(), request->lease()));
        HYPERMAP_ASSIGN_OR_RETURN(
            const GoalAnswer answer,
            explorations.Renew({request->robot(), request->goal_id(), lease, call.log().author()}));
        LogEdits(call, answer);
        response->set_revision(answer.revision);
        wire::EncodeGoal(answer.goal, answer.frame_from_layer, response->mutable_goal());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::ReleaseGoal(grpc::CallbackServerContext* context,
                                                          const v1::ReleaseGoalRequest* request,
                                                          v1::ReleaseGoalResponse* response) {
  return AnswerFromExplorations(
      context, "ReleaseGoal", request, response,
      [request, response](const UnaryCall& call,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(const GoalOutcome outcome,
                                  wire::DecodeGoalOutcome("outcome", request->outcome()));
        HYPERMAP_ASSIGN_OR_RETURN(const ExplorationAnswer answer,
                                  explorations.Release({request->robot(), request->goal_id(),
                                                        outcome, call.log().author()}));
        LogEdits(call, answer);
        response->set_revision(answer.revision);
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::StopExploration(
    grpc::CallbackServerContext* context, const v1::StopExplorationRequest* request,
    v1::StopExplorationResponse* response) {
  return AnswerFromExplorations(
      context, "StopExploration", request, response,
      [request, response](const UnaryCall& call,
                          MapExplorations& explorations) -> absl::StatusOr<int64_t> {
        HYPERMAP_ASSIGN_OR_RETURN(
            const ExplorationView view,
            explorations.Stop(request->exploration_id(), call.log().author()));
        LogEdits(call, view);
        response->set_revision(view.revision);
        wire::EncodeExploration(view.objects, view.frame_from_layer,
                                response->mutable_exploration());
        return 1;
      });
}

}  // namespace hypermap::server
