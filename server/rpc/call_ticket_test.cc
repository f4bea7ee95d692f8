// Tests of the admission of calls, with a server and clients.
#include "server/rpc/call_ticket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"
#include "client_libs/cpp/client.h"
#include "hypermap/v1/ingest_service.grpc.pb.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

using PointsStream = grpc::ClientReaderWriter<v1::QueryPointsRequest, v1::QueryPointsResponse>;

Limits FourCalls() {
  Limits limits;
  limits.max_calls = 4;
  return limits;
}

// A server with --max_calls=4, of which one client has two. The test's client holds both.
class CallTicketTest : public ::testing::Test {
 protected:
  static constexpr int kOfOneClient = 2;

  CallTicketTest() {
    server_.MakeMap("site", LayerOfCups("cups", 1));
    for (int i = 0; i < kOfOneClient; ++i) Occupy();
  }
  ~CallTicketTest() override {
    while (!streams_.empty()) EndOne();
  }

  // Begins a call that stays under way, and waits for its first answer.
  void Occupy() {
    contexts_.push_back(std::make_unique<grpc::ClientContext>());
    streams_.push_back(server_.query->QueryPoints(contexts_.back().get()));
    v1::QueryPointsRequest request;
    request.mutable_opening()->mutable_scope()->set_map("site");
    request.add_xs(0.5);
    request.add_ys(0.5);
    ASSERT_TRUE(streams_.back()->Write(request));
    v1::QueryPointsResponse response;
    ASSERT_TRUE(streams_.back()->Read(&response));
  }
  void EndOne() {
    streams_.back()->WritesDone();
    EXPECT_TRUE(streams_.back()->Finish().ok());
    streams_.pop_back();
    contexts_.pop_back();
  }

  static void ExpectRefused(const grpc::Status& status, const grpc::ClientContext& context) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("half of --max_calls, 4 calls"));
    const auto& metadata = context.GetServerTrailingMetadata();
    const auto pushback = metadata.find("grpc-retry-pushback-ms");
    ASSERT_NE(pushback, metadata.end());
    int pause_ms = 0;
    ASSERT_TRUE(absl::SimpleAtoi(
        absl::string_view(pushback->second.data(), pushback->second.size()), &pause_ms));
    EXPECT_GE(pause_ms, 100);
    EXPECT_LT(pause_ms, 1000);
  }

  TestServer server_{FourCalls()};
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts_;
  std::vector<std::unique_ptr<PointsStream>> streams_;
};

TEST_F(CallTicketTest, UnaryCallsBeyondTheLimitAreRefused) {
  {
    grpc::ClientContext context;
    v1::GetMapRequest request;
    v1::GetMapResponse response;
    ExpectRefused(server_.catalog->GetMap(&context, request, &response), context);
  }
  {
    grpc::ClientContext context;
    v1::QueryPointRequest request;
    v1::QueryPointResponse response;
    ExpectRefused(server_.query->QueryPoint(&context, request, &response), context);
  }
  {
    grpc::ClientContext context;
    v1::QueryNearestRequest request;
    v1::QueryNearestResponse response;
    ExpectRefused(server_.query->QueryNearest(&context, request, &response), context);
  }
  grpc::ClientContext context;
  v1::ApplyEditsRequest request;
  v1::ApplyEditsResponse response;
  ExpectRefused(server_.edit->ApplyEdits(&context, request, &response), context);
  EXPECT_EQ(server_.budgets().refusals.NumOf("--max_calls"), 4);
}

TEST_F(CallTicketTest, StreamsBeyondTheLimitAreRefused) {
  {
    grpc::ClientContext context;
    auto reader = server_.query->QueryArea(&context, {});
    EXPECT_TRUE(ReadAll(*reader).empty());
    ExpectRefused(reader->Finish(), context);
  }
  {
    grpc::ClientContext context;
    auto reader = server_.watch->Watch(&context, {});
    EXPECT_TRUE(ReadAll(*reader).empty());
    ExpectRefused(reader->Finish(), context);
  }
  {
    grpc::ClientContext context;
    auto reader = server_.catalog->ExportMap(&context, {});
    EXPECT_TRUE(ReadAll(*reader).empty());
    ExpectRefused(reader->Finish(), context);
  }
  {
    grpc::ClientContext context;
    auto stream = server_.query->QueryPoints(&context);
    v1::QueryPointsResponse response;
    EXPECT_FALSE(stream->Read(&response));
    ExpectRefused(stream->Finish(), context);
  }
  {
    grpc::ClientContext context;
    auto stream = v1::IngestService::NewStub(server_.channel())->Observe(&context);
    v1::ObserveResponse response;
    EXPECT_FALSE(stream->Read(&response));
    ExpectRefused(stream->Finish(), context);
  }
  grpc::ClientContext context;
  v1::ImportMapResponse response;
  auto writer = server_.catalog->ImportMap(&context, &response);
  ExpectRefused(writer->Finish(), context);
}

TEST_F(CallTicketTest, ARefusedClientThatComesAgainIsAdmittedWhenACallHasEnded) {
  auto maps = std::async(std::launch::async,
                         [this] { return client::Client(server_.address()).ListMaps().status(); });
  EXPECT_TRUE(
      testing::Eventually([this] { return server_.budgets().refusals.NumOf("--max_calls") != 0; }));
  EndOne();
  // The client comes again when it was told to.
  const absl::Status status = maps.get();
  EXPECT_TRUE(status.ok()) << status;
}

TEST_F(CallTicketTest, AClientThatDoesNotTryAgainGetsTheRefusal) {
  client::Client client(server_.address(), {.retry_for = absl::ZeroDuration()});
  EXPECT_TRUE(absl::IsResourceExhausted(client.ListMaps().status()));
}

}  // namespace
}  // namespace hypermap::server
