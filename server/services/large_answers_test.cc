// Tests of unary answers that are large, or that nobody reads.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hypermap/v1/query_service.pb.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// The map "site" has ten signs at (0, 0), each with a text of 100 kB.
class LargeAnswersTest : public ::testing::Test {
 protected:
  static constexpr size_t kTextBytes = 100'000;
  static constexpr int kSigns = 10;

  static Limits LimitsOf(int max_message_bytes) {
    Limits limits;
    limits.max_message_bytes = max_message_bytes;
    limits.max_request_bytes = 16 << 20;
    return limits;
  }

  explicit LargeAnswersTest(int max_message_bytes = 4 << 20)
      : server_(LimitsOf(max_message_bytes), 4 << 20) {
    EditBatch batch = LayerOfCups("signs", 0);
    for (int i = 0; i < kSigns; ++i) batch.edits.push_back({PutObject{"signs", Sign()}});
    server_.MakeMap("site", std::move(batch));
  }

  static SemanticObject Sign() {
    SemanticObject sign;
    sign.label = "sign";
    sign.shape = Shape::MakePointUnchecked({0, 0});
    sign.attributes = {{"text", std::string(kTextBytes, 'x')}};
    return sign;
  }

  static v1::QueryPointRequest PointRequest(double tolerance_m) {
    v1::QueryPointRequest request;
    request.mutable_scope()->set_map("site");
    request.mutable_point();
    request.set_tolerance_m(tolerance_m);
    return request;
  }

  // Asks, and does not read the answer.
  class UnreadCall {
   public:
    UnreadCall(const std::shared_ptr<grpc::Channel>& channel, const v1::QueryPointRequest& request)
        : stub_(channel),
          call_(stub_.PrepareCall(&context_, "/hypermap.v1.QueryService/QueryPoint", &queue_)) {
      const grpc::Slice slice(request.SerializeAsString());
      call_->StartCall(nullptr);
      Wait();
      call_->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
      Wait();
    }
    ~UnreadCall() {
      context_.TryCancel();
      End();
    }
    grpc::Status End() {
      if (ended_) return status_;
      ended_ = true;
      call_->Finish(&status_, nullptr);
      Wait();
      return status_;
    }

   private:
    void Wait() {
      void* tag = nullptr;
      bool ok = false;
      queue_.Next(&tag, &ok);
    }

    grpc::GenericStub stub_;
    grpc::ClientContext context_;
    grpc::CompletionQueue queue_;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
    bool ended_ = false;
    grpc::Status status_;
  };

  // A channel whose streams receive a few bytes ahead of their readers.
  std::shared_ptr<grpc::Channel> ShortSightedChannel() {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1024);
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    return grpc::CreateCustomChannel(server_.address(), grpc::InsecureChannelCredentials(),
                                     arguments);
  }
  int64_t used() { return server_.budgets().request_bytes.used(); }

  TestServer server_;
};

TEST_F(LargeAnswersTest, AnAnswerThatNobodyReadsIsChargedUntilItsCallEnds) {
  v1::QueryPointResponse response;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server_.query->QueryPoint(&context, PointRequest(0), &response).ok());
  }
  const auto answer_bytes = static_cast<int64_t>(response.ByteSizeLong());
  EXPECT_GE(answer_bytes, kSigns * kTextBytes);
  // A call that the client has seen the end of is charged until the server has seen it, too.
  ASSERT_TRUE(testing::Eventually([&] { return used() == 0; })) << used();
  const std::shared_ptr<grpc::Channel> channel = ShortSightedChannel();
  std::vector<std::unique_ptr<UnreadCall>> unread;
  for (int i = 1; i <= 5; ++i) {
    unread.push_back(std::make_unique<UnreadCall>(channel, PointRequest(0)));
    // To the byte: while an answer is made, other amounts are charged.
    ASSERT_TRUE(testing::Eventually([&] { return used() == i * answer_bytes; })) << used();
  }
  // One client may hold half of 16 MiB. Another answer is too much: making it takes four times its
  // bytes.
  grpc::ClientContext context;
  const grpc::Status refused = server_.query->QueryPoint(&context, PointRequest(0), &response);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("--max_request_bytes"));
  unread.clear();
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; })) << used();
  grpc::ClientContext again;
  EXPECT_TRUE(server_.query->QueryPoint(&again, PointRequest(0), &response).ok());
  EXPECT_EQ(response.layers(0).objects_size(), kSigns);
}

TEST_F(LargeAnswersTest, WhatAQuestionReadsOfThePastIsChargedUntilItIsAnswered) {
  // Revision r has r + 9 signs. Of 16 MiB, one client may hold half.
  MapSession& session = **server_.site().Find("site");
  while (session.snapshot()->revision < 100) {
    ASSERT_TRUE(session.SubmitAndWait({{{PutObject{"signs", Sign()}}}, "test", ""}).ok());
  }
  const auto ask_as_of = [&](Revision revision, const std::string& value) {
    grpc::ClientContext context;
    v1::QueryNearestRequest request;
    request.mutable_scope()->set_map("site");
    request.mutable_point();
    request.set_value(value);
    request.set_k(1);
    request.mutable_as_of()->set_at_revision(revision);
    v1::QueryNearestResponse response;
    return server_.query->QueryNearest(&context, request, &response);
  };
  EXPECT_TRUE(ask_as_of(1, "sign").ok());
  const grpc::Status refused = ask_as_of(90, "sign");
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("--max_request_bytes"));
  // A search reads its neighbourhood again when that was too small, but holds it once.
  const grpc::Status searched = ask_as_of(40, "cup");
  EXPECT_TRUE(searched.ok()) << searched.error_message();
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; })) << used();
}

TEST_F(LargeAnswersTest, ALargeReachGivesTheSameAnswer) {
  for (const double tolerance_m : {0.0, 1.0, 1e6}) {
    grpc::ClientContext context;
    v1::QueryPointResponse response;
    const grpc::Status status =
        server_.query->QueryPoint(&context, PointRequest(tolerance_m), &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.layers_size(), 1);
    EXPECT_EQ(response.layers(0).objects_size(), kSigns);
  }
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; })) << used();
}

class SmallMessagesTest : public LargeAnswersTest {
 protected:
  SmallMessagesTest() : LargeAnswersTest(kSigns * kTextBytes / 2) {}
};

TEST_F(SmallMessagesTest, AnAnswerLargerThanAMessageIsRefusedBeforeItIsMade) {
  for (const double tolerance_m : {0.0, 1e6}) {
    grpc::ClientContext context;
    v1::QueryPointResponse response;
    const grpc::Status status =
        server_.query->QueryPoint(&context, PointRequest(tolerance_m), &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("--max_message_bytes, 500000 bytes"));
    EXPECT_THAT(status.error_message(), HasSubstr("QueryArea"));
  }
  for (const int k : {kSigns, 100}) {
    grpc::ClientContext context;
    v1::QueryNearestRequest request;
    request.mutable_scope()->set_map("site");
    request.mutable_point();
    request.set_value("sign");
    request.set_k(k);
    v1::QueryNearestResponse response;
    EXPECT_EQ(server_.query->QueryNearest(&context, request, &response).error_code(),
              grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; })) << used();
}

}  // namespace
}  // namespace hypermap::server
