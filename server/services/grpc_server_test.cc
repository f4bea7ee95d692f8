#include "server/services/grpc_server.h"

#include <gmock/gmock.h>
#include <grpcpp/impl/client_unary_call.h>
#include <gtest/gtest.h>

#include "grpc/health/v1/health.pb.h"
#include "server/services/testing/test_server.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

TEST(GrpcServer, HealthOfTheServerAndOfEachServiceIsServing) {
  TestServer server;
  for (const char* service : {"", "hypermap.v1.CatalogService", "hypermap.v1.QueryService",
                              "hypermap.v1.EditService", "hypermap.v1.ExplorationService"}) {
    SCOPED_TRACE(service);
    grpc::health::v1::HealthCheckRequest request;
    request.set_service(service);
    grpc::health::v1::HealthCheckResponse response;
    grpc::ClientContext context;
    const grpc::internal::RpcMethod check("/grpc.health.v1.Health/Check",
                                          grpc::internal::RpcMethod::NORMAL_RPC);
    ASSERT_TRUE(grpc::internal::BlockingUnaryCall(server.channel().get(), check, &context, request,
                                                  &response)
                    .ok());
    EXPECT_EQ(response.status(), grpc::health::v1::HealthCheckResponse::SERVING);
  }
}

TEST(GrpcServer, TakenPortIsRefused) {
  TestServer server;
  const auto second = GrpcServer::Start({server.address(), 1 << 20}, Facilities());
  EXPECT_TRUE(absl::IsUnavailable(second.status())) << second.status();
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(server.address()));
}

TEST(GrpcServer, AddressWithoutAPortIsRefused) {
  for (const char* listen :
       {"", "127.0.0.1", ":", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000"}) {
    SCOPED_TRACE(listen);
    EXPECT_TRUE(
        absl::IsInvalidArgument(GrpcServer::Start({listen, 1 << 20}, Facilities()).status()));
  }
}

}  // namespace
}  // namespace hypermap::server
