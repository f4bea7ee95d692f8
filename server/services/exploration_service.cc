#include "server/services/exploration_service.h"

#include <memory>
#include <string>
#include <utility>

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

absl::StatusOr<StartOrder> DecodeStart(const v1::StartExplorationRequest& request,
                                       const wire::DecodeLimits& limits) {
  if (auto status = ValidateRequestId(request.request_id()); !status.ok()) return status;
  if (!request.has_area()) return absl::InvalidArgumentError("area is missing");
  absl::StatusOr<Polygon> area = wire::DecodePolygon("area", request.area(), limits);
  if (!area.ok()) return area.status();
  const absl::StatusOr<CellRule> rule =
      wire::DecodeCellRule("explored_rule", request.explored_rule());
  if (!rule.ok()) return rule.status();
  StartOrder order;
  order.area = *std::move(area);
  order.frame_id = request.frame_id();
  order.occupancy_layer = request.occupancy_layer();
  order.exploration_layer = request.exploration_layer();
  order.explored_rule = *rule;
  order.robot_radius_m = request.robot_radius_m();
  if (request.range_m() != 0.0) order.range_m = request.range_m();
  if (request.min_gain_cells() != 0) order.min_gain_cells = request.min_gain_cells();
  order.request_id = request.request_id();
  return order;
}

absl::StatusOr<ClaimOrder> DecodeClaim(const v1::ClaimGoalRequest& request) {
  if (!request.has_pose()) return absl::InvalidArgumentError("pose is missing");
  const absl::StatusOr<PlanarTransform> pose = wire::DecodePose("pose", request.pose());
  if (!pose.ok()) return pose.status();
  const absl::StatusOr<absl::Duration> lease = DecodeLease(request.has_lease(), request.lease());
  if (!lease.ok()) return lease.status();
  ClaimOrder order;
  order.exploration_id = request.exploration_id();
  order.robot = request.robot();
  order.place = {pose->x(), pose->y()};
  order.frame_id = request.frame_id();
  order.lease = *lease;
  return order;
}

// Logs the commit, if the call made one.
void LogEdits(const UnaryCall& call, const ExplorationAnswer& answer,
              const std::string& request_id = "") {
  if (answer.num_edits > 0) call.log().Edited(answer.revision, request_id, answer.num_edits);
}

}  // namespace

template <typename Request, typename Response, typename Answer>
grpc::ServerUnaryReactor* ExplorationService::AnswerFromDesk(grpc::CallbackServerContext* context,
                                                             absl::string_view rpc,
                                                             const Request* request,
                                                             Response* response, Answer answer) {
  auto call = std::make_shared<UnaryCall>(context, rpc, request->map());
  return AnswerOn(facilities_.explorers, call,
                  [this, call, request, response, answer]() -> absl::StatusOr<int64_t> {
                    const absl::StatusOr<std::shared_ptr<MapSession>> session =
                        FindMap(facilities_, request->map());
                    if (!session.ok()) return session.status();
                    response->set_map(request->map());
                    return answer(*call, *explorations_.Of(*session));
                  });
}

grpc::ServerUnaryReactor* ExplorationService::StartExploration(
    grpc::CallbackServerContext* context, const v1::StartExplorationRequest* request,
    v1::StartExplorationResponse* response) {
  return AnswerFromDesk(
      context, "StartExploration", request, response,
      [this, request, response](const UnaryCall& call,
                                ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        absl::StatusOr<StartOrder> order = DecodeStart(*request, facilities_.limits.decode);
        if (!order.ok()) return order.status();
        order->author = call.log().author();
        const absl::StatusOr<ExplorationView> view = desk.Start(*order);
        if (!view.ok()) return view.status();
        LogEdits(call, *view, request->request_id());
        response->set_revision(view->revision);
        wire::EncodeExploration(view->objects, view->frame_from_layer,
                                response->mutable_exploration());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::GetExploration(
    grpc::CallbackServerContext* context, const v1::GetExplorationRequest* request,
    v1::GetExplorationResponse* response) {
  return AnswerFromDesk(
      context, "GetExploration", request, response,
      [request, response](const UnaryCall&, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        const absl::StatusOr<ExplorationReport> report =
            desk.Get(request->exploration_id(), request->frame_id());
        if (!report.ok()) return report.status();
        response->set_revision(report->revision);
        response->set_frame_id(report->frame_id);
        wire::EncodeExploration(report->objects, report->frame_from_layer,
                                response->mutable_exploration());
        const ExplorationProgress& progress = report->progress;
        wire::EncodeProgress(progress.cells, progress.cell_area_m2, progress.rate_m2_per_s,
                             response->mutable_progress());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::ListExplorations(
    grpc::CallbackServerContext* context, const v1::ListExplorationsRequest* request,
    v1::ListExplorationsResponse* response) {
  return AnswerFromDesk(
      context, "ListExplorations", request, response,
      [request, response](const UnaryCall&, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        const absl::StatusOr<ExplorationList> list = desk.List(request->frame_id());
        if (!list.ok()) return list.status();
        response->set_revision(list->revision);
        response->set_frame_id(list->frame_id);
        for (const ExplorationObjects& objects : list->explorations) {
          wire::EncodeExploration(objects, list->frame_from_layer, response->add_explorations());
        }
        return response->explorations_size();
      });
}

grpc::ServerUnaryReactor* ExplorationService::ListFrontiers(grpc::CallbackServerContext* context,
                                                            const v1::ListFrontiersRequest* request,
                                                            v1::ListFrontiersResponse* response) {
  return AnswerFromDesk(
      context, "ListFrontiers", request, response,
      [request, response](const UnaryCall&, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        const absl::StatusOr<FrontierList> list =
            desk.ListFrontiers(request->exploration_id(), request->frame_id());
        if (!list.ok()) return list.status();
        response->set_revision(list->revision);
        response->set_frame_id(list->frame_id);
        response->set_exploration_id(list->exploration_id);
        for (const Explorer::FrontierView& frontier : list->frontiers) {
          wire::EncodeFrontier(frontier, list->geometry, list->frame_from_floor,
                               request->with_cells(), response->add_frontiers());
        }
        return response->frontiers_size();
      });
}

grpc::ServerUnaryReactor* ExplorationService::ClaimGoal(grpc::CallbackServerContext* context,
                                                        const v1::ClaimGoalRequest* request,
                                                        v1::ClaimGoalResponse* response) {
  return AnswerFromDesk(
      context, "ClaimGoal", request, response,
      [request, response](const UnaryCall& call, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        absl::StatusOr<ClaimOrder> order = DecodeClaim(*request);
        if (!order.ok()) return order.status();
        order->author = call.log().author();
        const absl::StatusOr<ClaimAnswer> answer = desk.Claim(*order);
        if (!answer.ok()) return answer.status();
        LogEdits(call, *answer);
        response->set_revision(answer->revision);
        response->set_frame_id(answer->frame_id);
        response->set_exploration_id(answer->exploration_id);
        response->set_state(wire::EncodeExplorationState(answer->state));
        response->set_end_reason(wire::EncodeEndReason(answer->end_reason));
        if (answer->goal) {
          wire::EncodeGoal(*answer->goal, answer->frame_from_layer, response->mutable_goal());
        }
        return answer->goal ? 1 : 0;
      });
}

grpc::ServerUnaryReactor* ExplorationService::RenewGoal(grpc::CallbackServerContext* context,
                                                        const v1::RenewGoalRequest* request,
                                                        v1::RenewGoalResponse* response) {
  return AnswerFromDesk(
      context, "RenewGoal", request, response,
      [request, response](const UnaryCall& call, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        const absl::StatusOr<absl::Duration> lease =
            DecodeLease(request->has_lease(), request->lease());
        if (!lease.ok()) return lease.status();
        const absl::StatusOr<GoalAnswer> answer =
            desk.Renew({request->robot(), request->goal_id(), *lease, call.log().author()});
        if (!answer.ok()) return answer.status();
        LogEdits(call, *answer);
        response->set_revision(answer->revision);
        wire::EncodeGoal(answer->goal, answer->frame_from_layer, response->mutable_goal());
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::ReleaseGoal(grpc::CallbackServerContext* context,
                                                          const v1::ReleaseGoalRequest* request,
                                                          v1::ReleaseGoalResponse* response) {
  return AnswerFromDesk(
      context, "ReleaseGoal", request, response,
      [request, response](const UnaryCall& call, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        const absl::StatusOr<GoalOutcome> outcome =
            wire::DecodeGoalOutcome("outcome", request->outcome());
        if (!outcome.ok()) return outcome.status();
        const absl::StatusOr<ExplorationAnswer> answer =
            desk.Release({request->robot(), request->goal_id(), *outcome, call.log().author()});
        if (!answer.ok()) return answer.status();
        LogEdits(call, *answer);
        response->set_revision(answer->revision);
        return 1;
      });
}

grpc::ServerUnaryReactor* ExplorationService::StopExploration(
    grpc::CallbackServerContext* context, const v1::StopExplorationRequest* request,
    v1::StopExplorationResponse* response) {
  return AnswerFromDesk(
      context, "StopExploration", request, response,
      [request, response](const UnaryCall& call, ExplorationDesk& desk) -> absl::StatusOr<int64_t> {
        const absl::StatusOr<ExplorationView> view =
            desk.Stop(request->exploration_id(), call.log().author());
        if (!view.ok()) return view.status();
        LogEdits(call, *view);
        response->set_revision(view->revision);
        wire::EncodeExploration(view->objects, view->frame_from_layer,
                                response->mutable_exploration());
        return 1;
      });
}

}  // namespace hypermap::server
