#include "server/services/grpc_server.h"

#include <gmock/gmock.h>
#include <grpcpp/impl/client_unary_call.h>
#include <gtest/gtest.h>

#include <string>

#include "base/admission/refusals.h"
#include "grpc/health/v1/health.pb.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

grpc::health::v1::HealthCheckResponse::ServingStatus HealthOf(TestServer& server,
                                                              const std::string& service) {
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  grpc::health::v1::HealthCheckResponse response;
  grpc::ClientContext context;
  const grpc::internal::RpcMethod check("/grpc.health.v1.Health/Check",
                                        grpc::internal::RpcMethod::NORMAL_RPC);
  const grpc::Status status = grpc::internal::BlockingUnaryCall(server.channel().get(), check,
                                                                &context, request, &response);
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
    return grpc::health::v1::HealthCheckResponse::SERVICE_UNKNOWN;
  }
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.status();
}

// The facilities of a server without maps.
class NoMaps {
 public:
  Facilities facilities() {
    return {nullptr, {}, &workers_, "", &budgets_, &access_, &meters_, &timers_};
  }

 private:
  Budgets budgets_{Limits()};
  AccessControl access_;
  RpcMeters meters_;
  TimerQueue timers_;
  WorkerPools workers_{1};
};

TEST(GrpcServer, HealthOfTheServerAndOfEachServiceIsServing) {
  TestServer server;
  for (const char* service :
       {"", "hypermap.v1.CatalogService", "hypermap.v1.QueryService", "hypermap.v1.EditService",
        "hypermap.v1.ExplorationService", "hypermap.v1.RobotService", GrpcServer::kAdmissionService,
        GrpcServer::kClockService}) {
    SCOPED_TRACE(service);
    EXPECT_EQ(HealthOf(server, service), grpc::health::v1::HealthCheckResponse::SERVING);
  }
}

TEST(GrpcServer, HealthTellsThatCallsAreRefusedForWantOfRoom) {
  TestServer server;
  EXPECT_TRUE(testing::Eventually([&] {
    // Each time, because the health service does not remember a refusal for long.
    server.budgets().refusals.Count(admission::TryLater("--max_calls"));
    return HealthOf(server, GrpcServer::kAdmissionService) ==
           grpc::health::v1::HealthCheckResponse::NOT_SERVING;
  }));
  EXPECT_EQ(HealthOf(server, ""), grpc::health::v1::HealthCheckResponse::SERVING);
}

TEST(GrpcServer, HealthOfAMapIsKnownWhileThereIsTheMap) {
  TestServer server;
  const auto health = [&] { return HealthOf(server, "map/site"); };
  using grpc::health::v1::HealthCheckResponse;
  EXPECT_EQ(health(), HealthCheckResponse::SERVICE_UNKNOWN);
  server.MakeMap("site", LayerOfCups("cups", 1));
  EXPECT_TRUE(testing::Eventually([&] { return health() == HealthCheckResponse::SERVING; }));
  EXPECT_TRUE(server.site().Delete("site", "").ok());
  EXPECT_TRUE(
      testing::Eventually([&] { return health() == HealthCheckResponse::SERVICE_UNKNOWN; }));
}

TEST(GrpcServer, TakenPortIsRefused) {
  TestServer server;
  NoMaps none;
  const auto second = GrpcServer::Start({server.address(), 1 << 20}, none.facilities());
  EXPECT_TRUE(absl::IsUnavailable(second.status())) << second.status();
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(server.address()));
}

TEST(GrpcServer, AddressWithoutAPortIsRefused) {
  NoMaps none;
  for (const char* listen :
       {"", "127.0.0.1", ":", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000"}) {
    SCOPED_TRACE(listen);
    EXPECT_TRUE(
        absl::IsInvalidArgument(GrpcServer::Start({listen, 1 << 20}, none.facilities()).status()));
  }
}

}  // namespace
}  // namespace hypermap::server
