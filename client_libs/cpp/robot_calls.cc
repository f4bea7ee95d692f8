// Robots of Client.
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/grpc_part_stream.h"
#include "wire/robot.h"

namespace hypermap::client {
namespace {

absl::StatusOr<RobotChanges> DecodeChanges(v1::WatchRobotsResponse&& message) {
  return wire::DecodeRobotChanges(message);
}

}  // namespace

absl::StatusOr<ReportAnswer> Client::ReportRobot(const std::string& map, const RobotReport& report,
                                                 const CallOptions& options) {
  v1::ReportRequest request;
  request.set_map(map);
  wire::EncodeReport(report, request.mutable_report());
  HYPERMAP_ASSIGN_OR_RETURN(const auto response,
                            connection_->Call(&v1::RobotService::Stub::Report, request, options));
  absl::StatusOr<ReportAnswer> answer = wire::DecodeReportAnswer(response);
  if (!answer.ok()) return BadAnswer(answer.status());
  return answer;
}

absl::StatusOr<RobotList> Client::ListRobots(const std::string& map, const CallOptions& options) {
  v1::ListRobotsRequest request;
  request.set_map(map);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::RobotService::Stub::ListRobots, request, options));
  absl::StatusOr<RobotList> list = wire::DecodeRobotList(response);
  if (!list.ok()) return BadAnswer(list.status());
  return list;
}

RobotReader Client::WatchRobots(const std::string& map, const CallOptions& options) {
  v1::WatchRobotsRequest request;
  request.set_map(map);
  CallOptions stream_options = options;
  stream_options.timeout = options.timeout.value_or(absl::InfiniteDuration());
  return RobotReader(MakeGrpcPartStream(connection_, &v1::RobotService::Stub::WatchRobots,
                                        std::move(request), stream_options, &DecodeChanges));
}

}  // namespace hypermap::client
