#include "server/services/grpc_server.h"

#include <gmock/gmock.h>
#include <grpcpp/impl/client_unary_call.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/admission/refusals.h"
#include "grpc/health/v1/health.pb.h"
#include "server/services/testing/test_server.h"

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
  EXPECT_TRUE(
      grpc::internal::BlockingUnaryCall(server.channel().get(), check, &context, request, &response)
          .ok());
  return response.status();
}

// What a server needs to be started, without maps.
class NoMaps {
 public:
  Facilities facilities() { return {nullptr, {}, &workers_, "", &budgets_}; }

 private:
  Budgets budgets_{Limits()};
  WorkerPools workers_{1};
};

TEST(GrpcServer, HealthOfTheServerAndOfEachServiceIsServing) {
  TestServer server;
  for (const char* service : {"", "hypermap.v1.CatalogService", "hypermap.v1.QueryService",
                              "hypermap.v1.EditService", "hypermap.v1.ExplorationService",
                              GrpcServer::kAdmissionService, GrpcServer::kClockService}) {
    SCOPED_TRACE(service);
    EXPECT_EQ(HealthOf(server, service), grpc::health::v1::HealthCheckResponse::SERVING);
  }
}

TEST(GrpcServer, HealthTellsThatCallsAreRefusedForWantOfRoom) {
  TestServer server;
  server.budgets().refusals.Count(admission::TryLater("--max_calls"));
  const absl::Time deadline = absl::Now() + absl::Seconds(30);
  auto status = HealthOf(server, GrpcServer::kAdmissionService);
  while (status == grpc::health::v1::HealthCheckResponse::SERVING && absl::Now() < deadline) {
    status = HealthOf(server, GrpcServer::kAdmissionService);
    // The refusal may be longer ago than the health service remembers it.
    server.budgets().refusals.Count(admission::TryLater("--max_calls"));
  }
  EXPECT_EQ(status, grpc::health::v1::HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(HealthOf(server, ""), grpc::health::v1::HealthCheckResponse::SERVING);
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
