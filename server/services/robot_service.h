// The gRPC service hypermap.v1.RobotService.
#ifndef HYPERMAP_SERVER_SERVICES_ROBOT_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_ROBOT_SERVICE_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "hypermap/v1/robot_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"
#include "server/watch/watch_call.h"

namespace hypermap::server {

// All methods are raw: the memory of a request is charged before it is parsed. The robots are held
// by the sessions of their maps. Thread safe.
class RobotService final
    : public v1::RobotService::WithRawCallbackMethod_Report<
          v1::RobotService::WithRawCallbackMethod_ListRobots<
              v1::RobotService::WithRawCallbackMethod_WatchRobots<v1::RobotService::Service>>> {
 public:
  // `watches` is the state of all watches of the server, which must outlive this.
  RobotService(const Facilities& facilities, WatchCall::Shared* watches)
      : facilities_(facilities), watches_(watches) {}

  grpc::ServerUnaryReactor* Report(grpc::CallbackServerContext* context,
                                   const grpc::ByteBuffer* request,
                                   grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListRobots(grpc::CallbackServerContext* context,
                                       const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchRobots(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request) override;

 private:
  // Return the number of robots in the response.
  absl::StatusOr<int64_t> TakeReport(const UnaryCall& call, const v1::ReportRequest& request,
                                     v1::ReportResponse* response) const;
  absl::StatusOr<int64_t> AnswerRobots(UnaryCall& call, const v1::ListRobotsRequest& request,
                                       v1::ListRobotsResponse* response) const;

  const Facilities facilities_;
  WatchCall::Shared* const watches_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_ROBOT_SERVICE_H_
