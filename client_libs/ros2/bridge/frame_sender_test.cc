#include "client_libs/ros2/bridge/frame_sender.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/frame_service.grpc.pb.h"
#include "tests/support/eventually.h"

namespace hypermap::ros2 {
namespace {

using testing::Eventually;

// An ingest worker that acknowledges frames as it is told.
class Worker : public v1::FrameService::Service {
 public:
  using Answer = std::function<v1::FrameOutcome(const v1::RobotFrame&)>;

  // Frames for which `answer` returns FRAME_OUTCOME_UNSPECIFIED are not acknowledged.
  explicit Worker(Answer answer, int port = 0) : answer_(std::move(answer)), port_(port) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(absl::StrCat("127.0.0.1:", port), grpc::InsecureServerCredentials(),
                             &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~Worker() override { server_->Shutdown(std::chrono::system_clock::now()); }

  int port() const { return port_; }
  std::vector<int64_t> received() {
    const MutexLock lock(&mutex_);
    return received_;
  }
  std::string robot() {
    const MutexLock lock(&mutex_);
    return robot_;
  }

  grpc::Status StreamFrames(grpc::ServerContext* /*context*/,
                            grpc::ServerReaderWriter<v1::StreamFramesResponse,
                                                     v1::StreamFramesRequest>* stream) override {
    v1::StreamFramesRequest request;
    while (stream->Read(&request)) {
      v1::StreamFramesResponse response;
      if (request.has_opening()) {
        response.mutable_opened()->set_queue(3);
        const MutexLock lock(&mutex_);
        robot_ = request.opening().robot();
      } else {
        const MutexLock lock(&mutex_);
        received_.push_back(request.frame().sequence());
        if (request.frame().sequence() < 0) {
          return {grpc::StatusCode::INVALID_ARGUMENT, "no StreamFramesRequest"};
        }
        const v1::FrameOutcome outcome = answer_(request.frame());
        if (outcome == v1::FRAME_OUTCOME_UNSPECIFIED) continue;
        v1::FrameAcknowledgement* const acknowledgement = response.add_acknowledgements();
        acknowledgement->set_sequence(request.frame().sequence());
        acknowledgement->set_outcome(outcome);
      }
      stream->Write(response);
    }
    return grpc::Status::OK;
  }

 private:
  const Answer answer_;
  int port_;
  Mutex mutex_;
  std::string robot_ ABSL_GUARDED_BY(mutex_);
  std::vector<int64_t> received_ ABSL_GUARDED_BY(mutex_);
  std::unique_ptr<grpc::Server> server_;
};

v1::FrameOutcome Accept(const v1::RobotFrame& /*frame*/) { return v1::FRAME_OUTCOME_ACCEPTED; }
v1::FrameOutcome Ignore(const v1::RobotFrame& /*frame*/) { return v1::FRAME_OUTCOME_UNSPECIFIED; }

std::unique_ptr<FrameSender> SenderTo(int port, FrameSenderOptions options = {}) {
  options.worker = absl::StrCat("127.0.0.1:", port);
  options.opening.set_robot("cart");
  return *FrameSender::Start(std::move(options));
}

// A frame of about a thousand bytes.
v1::RobotFrame FrameOf(int64_t sequence) {
  v1::RobotFrame frame;
  frame.set_sequence(sequence);
  frame.set_millimetres(std::string(1000, 'x'));
  return frame;
}

TEST(FrameSenderTest, OutcomesAreCounted) {
  Worker worker([](const v1::RobotFrame& frame) {
    return frame.sequence() == 1   ? v1::FRAME_OUTCOME_DUPLICATE
           : frame.sequence() == 2 ? v1::FRAME_OUTCOME_REFUSED_LATE
                                   : v1::FRAME_OUTCOME_ACCEPTED;
  });
  const auto sender = SenderTo(worker.port());
  for (int i = 1; i <= 20; ++i) sender->Send(FrameOf(i));
  EXPECT_TRUE(Eventually([&] { return sender->num_kept() == 0; }));
  EXPECT_EQ(sender->counts(), (FrameCounts{.accepted = 18, .duplicates = 1, .refused = 1}));
  EXPECT_EQ(worker.robot(), "cart");
}

TEST(FrameSenderTest, AtMostAsManyFramesAsTheWorkerQueuesAreUnderWay) {
  Worker worker(Ignore);
  const auto sender = SenderTo(worker.port());
  for (int i = 1; i <= 20; ++i) sender->Send(FrameOf(i));
  EXPECT_TRUE(Eventually([&] { return worker.received().size() == 3; }));
  EXPECT_EQ(sender->num_kept(), 20);
}

TEST(FrameSenderTest, FramesWithoutAcknowledgementAreSentAgainAfterARestart) {
  auto worker = std::make_unique<Worker>([](const v1::RobotFrame& frame) {
    return frame.sequence() == 1 ? v1::FRAME_OUTCOME_ACCEPTED : v1::FRAME_OUTCOME_UNSPECIFIED;
  });
  const int port = worker->port();
  const auto sender = SenderTo(port);
  for (int i = 1; i <= 3; ++i) sender->Send(FrameOf(i));
  EXPECT_TRUE(Eventually([&] { return worker->received().size() == 3; }));
  EXPECT_TRUE(Eventually([&] { return sender->num_kept() == 2; }));
  worker = nullptr;
  sender->Send(FrameOf(4));
  worker = std::make_unique<Worker>(Accept, port);
  EXPECT_TRUE(Eventually([&] { return sender->num_kept() == 0; }));
  EXPECT_EQ(worker->received(), (std::vector<int64_t>{2, 3, 4}));
  EXPECT_EQ(sender->counts(), (FrameCounts{.accepted = 4}));
}

TEST(FrameSenderTest, TheOldestFramesAreDroppedWhileTheWorkerIsAway) {
  auto worker = std::make_unique<Worker>(Accept);
  const int port = worker->port();
  worker = nullptr;
  const auto sender = SenderTo(port, {.max_bytes = 5'500});
  for (int i = 1; i <= 8; ++i) sender->Send(FrameOf(i));
  EXPECT_EQ(sender->counts(), (FrameCounts{.dropped = 3}));
  worker = std::make_unique<Worker>(Accept, port);
  EXPECT_TRUE(Eventually([&] { return sender->num_kept() == 0; }));
  EXPECT_EQ(worker->received(), (std::vector<int64_t>{4, 5, 6, 7, 8}));
}

TEST(FrameSenderTest, ASilentWorkerCountsAsBroken) {
  Worker worker(Ignore);
  const auto sender = SenderTo(worker.port(), {.patience = absl::Milliseconds(100)});
  sender->Send(FrameOf(1));
  EXPECT_TRUE(Eventually([&] { return worker.received().size() >= 2; }));
}

TEST(FrameSenderTest, AFrameThatTheWorkerCannotReadDoesNotHoldUpTheOthers) {
  Worker worker(Accept);
  const auto sender = SenderTo(worker.port());
  sender->Send(FrameOf(-1));
  EXPECT_TRUE(Eventually([&] { return sender->counts().dropped == 1; }));
  sender->Send(FrameOf(2));
  EXPECT_TRUE(Eventually([&] { return sender->counts().accepted == 1; }));
}

TEST(FrameSenderTest, ItEndsWhileTheWorkerIsSilent) {
  Worker worker(Ignore);
  const auto sender = SenderTo(worker.port());
  for (int i = 1; i <= 20; ++i) sender->Send(FrameOf(i));
  EXPECT_TRUE(Eventually([&] { return worker.received().size() == 3; }));
}

}  // namespace
}  // namespace hypermap::ros2
