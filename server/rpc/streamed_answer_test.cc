#include "server/rpc/streamed_answer.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <thread>

#include "base/cancellation/cancellation.h"
#include "hypermap/v1/query_service.grpc.pb.h"

namespace hypermap::server {
namespace {

using Response = v1::QueryAreaResponse;
using Source = MessageSource<Response>;

// A source whose messages a script of the test makes. Counts the sources that exist.
class ScriptedSource : public Source {
 public:
  using Script = std::function<absl::StatusOr<Step>(Response*)>;

  ScriptedSource(std::atomic<int>* alive, Script script)
      : alive_(alive), script_(std::move(script)) {
    ++*alive_;
  }
  ~ScriptedSource() override { --*alive_; }
  absl::StatusOr<Step> Next(Response* message) override { return script_(message); }
  int64_t items() const override { return 0; }

 private:
  std::atomic<int>* const alive_;
  const Script script_;
};

// A server that answers QueryArea by a script, on one worker.
class StreamedAnswerTest : public ::testing::Test {
 protected:
  void Serve(ScriptedSource::Script script) {
    service_.script = std::move(script);
    service_.test = this;
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    stub_ = v1::QueryService::NewStub(grpc::CreateChannel("127.0.0.1:" + std::to_string(port),
                                                          grpc::InsecureChannelCredentials()));
  }
  // Waits until all calls have ended.
  void TearDown() override {
    server_->Shutdown();
    server_->Wait();
    EXPECT_EQ(alive_, 0);
  }

  struct Service
      : v1::QueryService::WithRawCallbackMethod_QueryArea<v1::QueryService::CallbackService> {
    grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryArea(
        grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) override {
      auto* const answer = new StreamedAnswer<v1::QueryAreaRequest, Response>(
          CallFacilities{&test->budgets_, &test->access_, &test->meters_}, context, Rpc::kQueryArea,
          *request, &test->workers_, &test->workers_,
          [this](const v1::QueryAreaRequest&,
                 absl::string_view) -> absl::StatusOr<std::unique_ptr<Source>> {
            return std::make_unique<ScriptedSource>(&test->alive_, script);
          });
      if (begins_at_once) {
        answer->BeginAtOnce();
      } else {
        answer->BeginOnWorker();
      }
      return answer;
    }
    ScriptedSource::Script script;
    bool begins_at_once = false;
    StreamedAnswerTest* test = nullptr;
  };

  // Scripts run until TearDown has returned, so that the variables they use are members.
  std::atomic<int> alive_ = 0;
  std::atomic<int> steps_ = 0;
  std::atomic<bool> other_ran_ = false;
  Budgets budgets_{Limits()};
  AccessControl access_;
  RpcMeters meters_;
  WorkerPool workers_{"hm-test", 1};
  Service service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<v1::QueryService::Stub> stub_;
};

TEST_F(StreamedAnswerTest, MessagesArriveInOrderThenTheEnd) {
  Serve([this](Response* message) -> absl::StatusOr<Source::Step> {
    if (steps_ == 20) return Source::Step::kEnd;
    if (++steps_ % 3 == 0) return Source::Step::kNothingYet;
    message->set_revision(steps_);
    return Source::Step::kMessage;
  });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  for (int i = 1; i <= 20; ++i) {
    if (i % 3 == 0) continue;
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.revision(), i);
  }
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
}

TEST_F(StreamedAnswerTest, AWorkerBeginsAnewWhatIsTooLongForGrpcsThread) {
  service_.begins_at_once = true;
  Serve([this](Response* message) -> absl::StatusOr<Source::Step> {
    switch (++steps_) {
      case 1:
        while (!IsCancelled()) continue;
        return Source::Step::kNothingYet;
      case 2:
        EXPECT_FALSE(IsCancelled());
        message->set_revision(7);
        return Source::Step::kMessage;
      default:
        return Source::Step::kEnd;
    }
  });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.revision(), 7);
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(steps_, 3);
}

TEST_F(StreamedAnswerTest, ErrorEndsTheStream) {
  Serve([](Response*) { return absl::DataLossError("tile 3 is damaged"); });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  EXPECT_FALSE(reader->Read(&response));
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(status.error_message(), "tile 3 is damaged");
}

TEST_F(StreamedAnswerTest, DeadlineEndsAStretchWithoutMatches) {
  Serve([](Response*) { return Source::Step::kNothingYet; });
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + absl::Milliseconds(50)));
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(StreamedAnswerTest, CallerThatGoesAwayEndsTheWork) {
  Serve([](Response*) { return Source::Step::kMessage; });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  ASSERT_TRUE(reader->Read(&response));
  context.TryCancel();
  while (reader->Read(&response)) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(StreamedAnswerTest, A4_LoopWithinAStepEndsWhenTheCallerGoesAway) {
  Serve([this](Response*) {
    ++steps_;
    while (!IsCancelled()) std::this_thread::yield();
    return Source::Step::kMessage;
  });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  while (steps_ == 0) std::this_thread::yield();
  context.TryCancel();
  Response response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(StreamedAnswerTest, A4_LoopWithinAStepEndsAtTheDeadline) {
  Serve([](Response*) {
    while (!IsCancelled()) std::this_thread::yield();
    return Source::Step::kMessage;
  });
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + absl::Milliseconds(50)));
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(StreamedAnswerTest, OthersGetTheWorkerDuringLongWork) {
  Serve([this](Response*) { return other_ran_ ? Source::Step::kEnd : Source::Step::kNothingYet; });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  workers_.Run([this] { other_ran_ = true; });
  Response response;
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
}

TEST_F(StreamedAnswerTest, SlowReaderHoldsTheSourceBack) {
  Serve([this](Response* message) {
    ++steps_;
    message->mutable_part()->set_layer(std::string(256 << 10, 'x'));
    return Source::Step::kMessage;
  });
  grpc::ClientContext context;
  auto reader = stub_->QueryArea(&context, {});
  Response response;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(reader->Read(&response));
  // gRPC buffers some messages for the reader, but a bounded number.
  EXPECT_LT(steps_, 200);
  context.TryCancel();
  while (reader->Read(&response)) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

}  // namespace
}  // namespace hypermap::server
