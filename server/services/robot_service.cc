#include "server/services/robot_service.h"

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/robots/robot_presence.h"
#include "map/robots/robot_report.h"
#include "server/presence/map_robots.h"
#include "server/rpc/raw_messages.h"
#include "server/services/robot_source.h"
#include "wire/robot.h"

namespace hypermap::server {

grpc::ServerUnaryReactor* RobotService::Report(grpc::CallbackServerContext* context,
                                               const grpc::ByteBuffer* request,
                                               grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ReportRequest, v1::ReportResponse>(
      facilities_.for_calls(), context, Rpc::kReport, {request, response});
  return AnswerOn(&facilities_.workers->questions, call,
                  [this, call] { return TakeReport(*call, call->request(), call->response()); });
}

absl::StatusOr<int64_t> RobotService::TakeReport(const UnaryCall& call,
                                                 const v1::ReportRequest& request,
                                                 v1::ReportResponse* response) const {
  HYPERMAP_RETURN_IF_ERROR(call.context().caller().CheckRobot(request.report().robot()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map()));
  HYPERMAP_ASSIGN_OR_RETURN(RobotReport report, wire::DecodeReport("report", request.report()));
  if (const absl::Status valid = Validate(report); !valid.ok()) {
    return absl::Status(valid.code(), absl::StrCat("report.", valid.message()));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const bool accepted, session->robots().Report(std::move(report)));
  response->set_map(request.map());
  response->set_revision(session->snapshot()->revision);
  response->set_incarnation(session->incarnation());
  response->set_outcome(wire::EncodeReportOutcome(accepted));
  return 1;
}

grpc::ServerUnaryReactor* RobotService::ListRobots(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request,
                                                   grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::ListRobotsRequest, v1::ListRobotsResponse>(
      facilities_.for_calls(), context, Rpc::kListRobots, {request, response});
  return AnswerOn(&facilities_.workers->questions, call,
                  [this, call] { return AnswerRobots(*call, call->request(), call->response()); });
}

absl::StatusOr<int64_t> RobotService::AnswerRobots(UnaryCall& call,
                                                   const v1::ListRobotsRequest& request,
                                                   v1::ListRobotsResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.map()));
  const SnapshotPtr snapshot = session->snapshot();
  response->set_map(request.map());
  wire::EncodeRobotsAt(DescribeRobotsAt(*session, *snapshot), response);
  call.set_advice("watch the robots instead");
  for (const RobotPresence& robot : session->robots().List()) {
    v1::RobotPresence* const encoded = response->add_robots();
    wire::EncodePresence(InMapFrame(robot, snapshot->frames, snapshot->frame_id), encoded);
    HYPERMAP_RETURN_IF_ERROR(ReservePart(call, *encoded));
  }
  return response->robots_size();
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* RobotService::WatchRobots(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return BeginWatchCall<v1::WatchRobotsRequest>(
      context, Rpc::kWatchRobots, *request,
      CheckRequestSize(*request, FixedLimits::kMaxRequestBytes),
      [this](const v1::WatchRobotsRequest& asked) -> absl::StatusOr<std::unique_ptr<RobotSource>> {
        HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session,
                                  FindMap(facilities_, asked.map()));
        return std::make_unique<RobotSource>(facilities_.limits, std::move(session));
      },
      watches_);
}

}  // namespace hypermap::server
