#include "ingest/frame_service/frame_call.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "base/cancellation/cancellation.h"
#include "hypermap/v1/frame_service.grpc.pb.h"
#include "hypermap/v1/ingest_service.grpc.pb.h"

namespace hypermap::ingest {
namespace {

using ::testing::HasSubstr;

// A Hypermap server that accepts all observations, but those of the robot "wordy".
class AcceptingServer : public v1::IngestService::Service {
 public:
  AcceptingServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~AcceptingServer() override { server_->Shutdown(); }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }

  grpc::Status Observe(
      grpc::ServerContext* /*context*/,
      grpc::ServerReaderWriter<v1::ObserveResponse, v1::ObserveRequest>* stream) override {
    v1::ObserveRequest request;
    while (stream->Read(&request)) {
      v1::ObserveResponse response;
      if (request.has_opening()) response.mutable_opened();
      for (const v1::Observation& observation : request.observations()) {
        v1::ObservationAcknowledgement* acknowledgement = response.add_acknowledgements();
        acknowledgement->set_sequence(observation.sequence());
        acknowledgement->set_revision(1);
        acknowledgement->set_outcome(v1::OBSERVATION_OUTCOME_ACCEPTED);
        if (observation.robot() != "wordy") continue;
        acknowledgement->set_outcome(v1::OBSERVATION_OUTCOME_INVALID);
        acknowledgement->set_message(std::string(100'000, 'w'));
      }
      stream->Write(response);
    }
    return grpc::Status::OK;
  }

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

constexpr int kWidth = 512;
constexpr int kHeight = 512;
constexpr int64_t kPixels = int64_t{kWidth} * kHeight;

v1::StreamFramesRequest Opening(const std::string& robot, bool drop_oldest = false) {
  v1::StreamFramesRequest request;
  request.mutable_opening()->set_robot(robot);
  request.mutable_opening()->set_drop_oldest(drop_oldest);
  v1::CameraModel* camera = request.mutable_opening()->mutable_camera();
  camera->set_width(kWidth);
  camera->set_height(kHeight);
  camera->set_fx(500);
  camera->set_fy(500);
  camera->set_cx(kWidth / 2.0);
  camera->set_cy(kHeight / 2.0);
  return request;
}

// A frame that shows a wall at 1 m, with as many instances that have the whole image as their mask.
v1::StreamFramesRequest FrameOf(int64_t sequence, int instances) {
  v1::StreamFramesRequest request;
  v1::RobotFrame* frame = request.mutable_frame();
  frame->set_sequence(sequence);
  frame->mutable_stamp()->set_seconds(1'500'000'000 + sequence);
  frame->mutable_pose()->set_z(1);
  frame->mutable_pose()->set_qx(-0.5);
  frame->mutable_pose()->set_qy(0.5);
  frame->mutable_pose()->set_qz(-0.5);
  frame->mutable_pose()->set_qw(0.5);
  for (int64_t i = 0; i < kPixels; ++i) frame->mutable_millimetres()->append("\xe8\x03");
  for (int i = 0; i < instances; ++i) {
    v1::FrameInstance* instance = frame->add_instances();
    v1::ClassScore* score = instance->add_scores();
    score->set_label("wall");
    score->set_score(0.5);
    instance->mutable_runs()->add_counts(0);
    instance->mutable_runs()->add_counts(kPixels);
  }
  return request;
}

// A robot's side of a stream.
class Robot {
 public:
  explicit Robot(const std::string& address)
      : stub_(v1::FrameService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))),
        stream_(stub_->StreamFrames(&context_)) {}
  ~Robot() { context_.TryCancel(); }

  // Returns whether the stream was opened.
  bool Open(const std::string& name, bool drop_oldest = false) {
    Write(Opening(name, drop_oldest));
    v1::StreamFramesResponse response;
    return stream_->Read(&response) && response.has_opened();
  }
  bool Write(const v1::StreamFramesRequest& request) { return stream_->Write(request); }
  void WritesDone() { stream_->WritesDone(); }
  bool Read(v1::StreamFramesResponse* response) { return stream_->Read(response); }
  // Returns the next acknowledgement; one without a sequence if the stream ended.
  v1::FrameAcknowledgement Next() {
    while (read_.acknowledgements().empty()) {
      if (!stream_->Read(&read_)) return {};
    }
    v1::FrameAcknowledgement next = read_.acknowledgements(0);
    read_.mutable_acknowledgements()->DeleteSubrange(0, 1);
    return next;
  }
  grpc::Status Finish() {
    v1::StreamFramesResponse ignored;
    while (stream_->Read(&ignored)) {
    }
    return stream_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::FrameService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamFramesRequest, v1::StreamFramesResponse>>
      stream_;
  v1::StreamFramesResponse read_;
};

// Calls a function for each mask, and finds no pixels.
class CallingSegmenter : public Segmenter {
 public:
  explicit CallingSegmenter(std::function<void()> call) : call_(std::move(call)) {}
  std::vector<int32_t> Segment(const OrganisedCloud& /*cloud*/,
                               const std::vector<uint8_t>& /*mask*/) const override {
    call_();
    return {};
  }
  int bytes_per_pixel() const override { return 50; }

 private:
  const std::function<void()> call_;
};

class FrameCallTest : public testing::Test {
 protected:
  void Start(
      const FrameServerOptions& options, std::function<void()> in_work = [] {}) {
    auto observer = std::make_shared<const Observer>(
        std::make_unique<CallingSegmenter>(std::move(in_work)), nullptr, ObserverOptions());
    absl::StatusOr<std::unique_ptr<FrameServer>> server =
        FrameServer::Start(options, client::Client(upstream_.address()), std::move(observer));
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }
  const std::string& address() const { return server_->address(); }

  AcceptingServer upstream_;
  std::unique_ptr<FrameServer> server_;
};

TEST_F(FrameCallTest, FramesAreAcknowledged) {
  Start({});
  Robot robot(address());
  ASSERT_TRUE(robot.Open("cart"));
  for (int i = 1; i <= 3; ++i) {
    robot.Write(FrameOf(i, 1));
    const v1::FrameAcknowledgement acknowledgement = robot.Next();
    EXPECT_EQ(acknowledgement.sequence(), i);
    EXPECT_EQ(acknowledgement.outcome(), v1::FRAME_OUTCOME_ACCEPTED);
  }
  robot.WritesDone();
  EXPECT_TRUE(robot.Finish().ok());
}

TEST_F(FrameCallTest, StreamsBeyondTheLimitAreRefusedAndLogged) {
  Mutex mutex;
  std::vector<std::string> lines;
  Start({.max_streams = 4, .log = [&](const std::string& line) {
           const MutexLock lock(&mutex);
           lines.push_back(line);
         }});
  Robot first(address());
  Robot second(address());
  ASSERT_TRUE(first.Open("first"));
  ASSERT_TRUE(second.Open("second"));
  // Half of the streams are for one client address.
  for (int i = 0; i < 3; ++i) {
    const grpc::Status refused = Robot(address()).Finish();
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("--max_streams, 4 streams"));
  }
  first.WritesDone();
  EXPECT_TRUE(first.Finish().ok());
  EXPECT_TRUE(Robot(address()).Open("third"));
  const MutexLock lock(&mutex);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("--max_streams"));
}

TEST_F(FrameCallTest, MessagesAreChargedBeforeTheyAreParsed) {
  Start({.memory_limit = 128 << 20});
  Robot robot(address());
  ASSERT_TRUE(robot.Open("cart"));
  v1::StreamFramesRequest many = FrameOf(1, 0);
  // Two bytes each in the message, and about forty times as many when it is parsed.
  for (int i = 0; i < 1'000'000; ++i) many.mutable_frame()->add_instances();
  robot.Write(many);
  const grpc::Status status = robot.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("half of --memory_limit, 134217728 bytes"));
  Robot other(address());
  ASSERT_TRUE(other.Open("other"));
  other.Write(FrameOf(1, 1));
  EXPECT_EQ(other.Next().outcome(), v1::FRAME_OUTCOME_ACCEPTED);
}

TEST_F(FrameCallTest, MasksAreChargedBeforeTheyAreDecoded) {
  Start({.memory_limit = 128 << 20});
  Robot robot(address());
  ASSERT_TRUE(robot.Open("cart"));
  robot.Write(FrameOf(1, 254));  // 64 MiB
  const v1::FrameAcknowledgement refused = robot.Next();
  EXPECT_EQ(refused.sequence(), 1);
  EXPECT_EQ(refused.outcome(), v1::FRAME_OUTCOME_INVALID);
  EXPECT_THAT(refused.message(), HasSubstr("--memory_limit"));
  robot.Write(FrameOf(2, 1));
  EXPECT_EQ(robot.Next().outcome(), v1::FRAME_OUTCOME_ACCEPTED);
}

// A client may hold 64 MiB: a camera with 25 MB, and one of these frames with 26 MB.
TEST_F(FrameCallTest, ChargesEndWithTheirFramesAndStreams) {
  Start({.memory_limit = 128 << 20});
  for (int stream = 0; stream < 3; ++stream) {
    Robot robot(address());
    ASSERT_TRUE(robot.Open("cart"));
    for (int i = 1; i <= 3; ++i) {
      robot.Write(FrameOf(i, 100));
      const v1::FrameAcknowledgement acknowledgement = robot.Next();
      EXPECT_EQ(acknowledgement.outcome(), v1::FRAME_OUTCOME_ACCEPTED) << acknowledgement.message();
    }
    robot.WritesDone();
    EXPECT_TRUE(robot.Finish().ok());
  }
}

TEST_F(FrameCallTest, TheQueueIsBoundedByItsBytes) {
  absl::Notification in_work;
  absl::Notification go_on;
  Start({.queue = 100, .max_queue_bytes = 1}, [&] {
    if (!in_work.HasBeenNotified()) in_work.Notify();
    go_on.WaitForNotification();
  });
  Robot robot(address());
  ASSERT_TRUE(robot.Open("hasty", /*drop_oldest=*/true));
  robot.Write(FrameOf(1, 1));
  in_work.WaitForNotification();
  for (int i = 2; i <= 6; ++i) robot.Write(FrameOf(i, 1));
  for (int i = 2; i <= 5; ++i) {
    const v1::FrameAcknowledgement dropped = robot.Next();
    EXPECT_EQ(dropped.sequence(), i);
    EXPECT_EQ(dropped.outcome(), v1::FRAME_OUTCOME_DROPPED);
  }
  go_on.Notify();
  std::set<int64_t> accepted;
  for (int i = 0; i < 2; ++i) accepted.insert(robot.Next().sequence());
  EXPECT_EQ(accepted, (std::set<int64_t>{1, 6}));
}

// The requests fit into the window of HTTP/2, so that the robot can write all of them before it
// reads.
TEST_F(FrameCallTest, ReadingPausesWhileManyAcknowledgementsWait) {
  constexpr int kRequests = 10'000;
  Start({});
  Robot robot(address());
  ASSERT_TRUE(robot.Open("deaf"));
  for (int i = 0; i < kRequests; ++i) ASSERT_TRUE(robot.Write({}));
  robot.WritesDone();
  int acknowledged = 0;
  v1::StreamFramesResponse response;
  while (robot.Read(&response)) {
    EXPECT_LE(response.acknowledgements_size(), FrameCall::kMaxWaitingAcknowledgements);
    acknowledged += response.acknowledgements_size();
  }
  EXPECT_EQ(acknowledged, kRequests);
  EXPECT_TRUE(robot.Finish().ok());
}

TEST_F(FrameCallTest, LongMessagesOfTheServerAreCut) {
  Start({});
  Robot robot(address());
  ASSERT_TRUE(robot.Open("wordy"));
  robot.Write(FrameOf(1, 0));
  const v1::FrameAcknowledgement acknowledgement = robot.Next();
  EXPECT_EQ(acknowledgement.outcome(), v1::FRAME_OUTCOME_INVALID);
  EXPECT_THAT(acknowledgement.message(), HasSubstr("www"));
  EXPECT_LT(acknowledgement.message().size(), 3'000u);
}

TEST_F(FrameCallTest, BytesThatAreNoRequestEndTheStream) {
  Start({});
  Robot robot(address());
  robot.Write(Opening("\xff"));  // no UTF-8
  const grpc::Status status = robot.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("StreamFramesRequest"));
}

TEST_F(FrameCallTest, AShutdownGivesUpTheFrameInWork) {
  absl::Notification in_work;
  Start({}, [&in_work] {
    in_work.Notify();
    while (!IsCancelled()) {
    }
  });
  Robot robot(address());
  ASSERT_TRUE(robot.Open("cart"));
  robot.Write(FrameOf(1, 1));
  in_work.WaitForNotification();
  server_->Shutdown();
  EXPECT_FALSE(robot.Finish().ok());
}

TEST_F(FrameCallTest, ARobotThatGoesAwayGivesUpItsFrameInWork) {
  absl::Notification in_work;
  absl::Notification given_up;
  Start({}, [&] {
    in_work.Notify();
    while (!IsCancelled()) {
    }
    given_up.Notify();
  });
  {
    Robot robot(address());
    ASSERT_TRUE(robot.Open("cart"));
    robot.Write(FrameOf(1, 1));
    in_work.WaitForNotification();
  }
  given_up.WaitForNotification();
}

}  // namespace
}  // namespace hypermap::ingest
