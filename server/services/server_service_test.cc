#include "server/services/server_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/services/testing/test_server.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// Lists of several servers are tested with a database (tests/integration/test_failover.py).
TEST(ServerServiceTest, AServerThatSharesNoStoreSaysSo) {
  TestServer server;
  const auto stub = v1::ServerService::NewStub(server.channel());
  grpc::ClientContext context;
  v1::ListServersResponse response;
  const grpc::Status status = stub->ListServers(&context, {}, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_THAT(status.error_message(), HasSubstr("shares its maps with no others"));
}

TEST(ServerServiceTest, AServerThatSharesNoStoreIsNotDrained) {
  TestServer server;
  const auto stub = v1::ServerService::NewStub(server.channel());
  grpc::ClientContext context;
  v1::DrainServerResponse response;
  const grpc::Status status = stub->DrainServer(&context, {}, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_THAT(status.error_message(), HasSubstr("shares its maps with no others"));
}

}  // namespace
}  // namespace hypermap::server
