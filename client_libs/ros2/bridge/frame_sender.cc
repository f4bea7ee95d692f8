#include "client_libs/ros2/bridge/frame_sender.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "base/sync/start_thread.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/bridge/frame_queue.h"
#include "client_libs/ros2/bridge/problem_log.h"
#include "hypermap/v1/frame_service.grpc.pb.h"
#include "wire/status.h"

namespace hypermap::ros2 {
namespace {

using FrameRpc = grpc::ClientReaderWriter<v1::StreamFramesRequest, v1::StreamFramesResponse>;

// How long a step waits for the worker, so that the program can end.
constexpr absl::Duration kWait = absl::Milliseconds(200);
// Before another stream is opened to a worker that is there.
constexpr absl::Duration kBetweenStreams = absl::Seconds(1);

std::shared_ptr<grpc::Channel> MakeChannel(const std::string& worker) {
  grpc::ChannelArguments arguments;
  // A layer may have very many frames of the robot, which the worker lists in its first answer.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A worker that is back is found soon.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  return grpc::CreateCustomChannel(worker, grpc::InsecureChannelCredentials(), arguments);
}

}  // namespace

class FrameSender::Loop {
 public:
  explicit Loop(FrameSenderOptions options)
      : options_(std::move(options)),
        channel_(MakeChannel(options_.worker)),
        stub_(v1::FrameService::NewStub(channel_)),
        queue_(options_.max_bytes) {}

  void Send(v1::RobotFrame frame) {
    const MutexLock lock(&mutex_);
    const int num_dropped = queue_.Push(std::move(frame));
    counts_.dropped += num_dropped;
    if (num_dropped > 0) {
      problems_.Note("frames are dropped",
                     absl::ResourceExhaustedError("the worker is away or too slow"), num_dropped);
    }
    // Here as well, because a step may wait in Write.
    CancelIfSilent();
  }

  FrameCounts counts() const {
    const MutexLock lock(&mutex_);
    return counts_;
  }

  int64_t num_kept() const {
    const MutexLock lock(&mutex_);
    return static_cast<int64_t>(queue_.size());
  }

  // `wake` makes the next step due.
  void SetWake(std::function<void()> wake) {
    const MutexLock lock(&mutex_);
    wake_ = std::move(wake);
    wake_();
  }

  void End() {
    const MutexLock lock(&mutex_);
    ends_ = true;
    if (context_) context_->TryCancel();
  }

  std::optional<absl::Duration> Step() {
    if (IsBroken()) CloseStream();
    if (Ends()) {
      CloseStream();
      return std::nullopt;
    }
    if (stream_ == nullptr) {
      const absl::Duration pause = open_at_ - SteadyTime::Now();
      return pause > absl::ZeroDuration() ? pause : OpenStream();
    }
    while (const FrameQueue::Frame frame = NextFrame()) {
      v1::StreamFramesRequest request;
      *request.mutable_frame() = *frame;
      if (!stream_->Write(request)) break;  // The reader learns why.
    }
    const MutexLock lock(&mutex_);
    CancelIfSilent();
    return is_owed() ? kBetweenStreams : absl::InfiniteDuration();
  }

 private:
  bool Ends() const {
    const MutexLock lock(&mutex_);
    return ends_;
  }

  bool IsBroken() const {
    const MutexLock lock(&mutex_);
    return is_broken_;
  }

  // Whether the worker owes the answer to the opening, or an acknowledgement.
  bool is_owed() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return context_ != nullptr && (window_ == 0 || queue_.num_sent() > 0);
  }

  // A dead connection may give no other sign than silence.
  void CancelIfSilent() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (is_owed() && SteadyTime::Now() - heard_ > options_.patience) context_->TryCancel();
  }

  FrameQueue::Frame NextFrame() {
    const MutexLock lock(&mutex_);
    if (is_broken_ || ends_) return nullptr;
    if (queue_.num_sent() == 0) heard_ = SteadyTime::Now();  // Nothing was owed before.
    return queue_.Next(window_);
  }

  // Returns the time until the next step.
  absl::Duration OpenStream() {
    const auto deadline = std::chrono::system_clock::now() + absl::ToChronoMilliseconds(kWait);
    if (!channel_->WaitForConnected(deadline)) {
      const MutexLock lock(&mutex_);
      Tell(absl::UnavailableError(absl::StrCat("no ingest worker at ", options_.worker)));
      return absl::ZeroDuration();
    }
    v1::StreamFramesRequest request;
    *request.mutable_opening() = options_.opening;
    {
      const MutexLock lock(&mutex_);
      if (ends_) return absl::ZeroDuration();
      context_ = std::make_unique<grpc::ClientContext>();
      window_ = 0;
      heard_ = SteadyTime::Now();
    }
    stream_ = stub_->StreamFrames(context_.get());
    absl::StatusOr<std::thread> reader =
        StartThread("hm-ros2-acks", [this, stream = stream_.get()] { Read(stream); });
    if (!reader.ok()) {
      CloseStream();
      return absl::ZeroDuration();
    }
    reader_ = *std::move(reader);
    stream_->Write(request);  // An error shows in Read and Finish.
    return absl::ZeroDuration();
  }

  // On the reader's thread: reads until the stream ends.
  void Read(FrameRpc* stream) {
    v1::StreamFramesResponse response;
    while (stream->Read(&response)) {
      Take(response);
      response.Clear();
    }
    const MutexLock lock(&mutex_);
    is_broken_ = true;
    wake_();
  }

  void Take(const v1::StreamFramesResponse& response) {
    const MutexLock lock(&mutex_);
    heard_ = SteadyTime::Now();
    if (response.has_opened()) window_ = std::max(response.opened().queue(), 1);
    for (const v1::FrameAcknowledgement& acknowledgement : response.acknowledgements()) {
      Note(acknowledgement);
    }
    wake_();
  }

  void Note(const v1::FrameAcknowledgement& acknowledgement) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (!queue_.Remove(acknowledgement.sequence())) return;
    if (std::exchange(is_away_, false)) {
      logging::Log(logging::Level::kInfo, "the ingest worker takes frames",
                   {{"worker", options_.worker}, {"robot", options_.opening.robot()}});
    }
    switch (acknowledgement.outcome()) {
      case v1::FRAME_OUTCOME_ACCEPTED:
        ++counts_.accepted;
        break;
      case v1::FRAME_OUTCOME_DUPLICATE:
        ++counts_.duplicates;
        break;
      default:
        ++counts_.refused;
        problems_.Note("frames are refused", absl::FailedPreconditionError(absl::StrCat(
                                                 v1::FrameOutcome_Name(acknowledgement.outcome()),
                                                 ": ", acknowledgement.message())));
    }
  }

  // Ends the stream, if there is one; its frames without acknowledgement are sent again with the
  // next one.
  void CloseStream() {
    if (stream_ == nullptr) return;
    // A stream that has ended by itself keeps its status.
    if (!IsBroken()) context_->TryCancel();
    if (reader_.joinable()) reader_.join();
    const absl::Status status = wire::DecodeStatus(stream_->Finish());
    stream_ = nullptr;
    open_at_ = SteadyTime::Now() + kBetweenStreams;
    const MutexLock lock(&mutex_);
    context_ = nullptr;
    is_broken_ = false;
    if (ends_) return;
    if (window_ > 0 && absl::IsInvalidArgument(status)) {
      // One of them is no message for the worker, and would end the next stream, too.
      counts_.dropped += queue_.RemoveSent();
    }
    queue_.SendAgain();
    Tell(status.ok() ? absl::UnavailableError("the worker ended the stream") : status);
  }

  void Tell(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    is_away_ = true;
    problems_.Note("frames are not sent", status);
  }

  const FrameSenderOptions options_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<v1::FrameService::Stub> stub_;
  ProblemLog problems_;
  // Of the thread of the steps.
  std::unique_ptr<FrameRpc> stream_;
  std::thread reader_;
  SteadyTime open_at_ = SteadyTime::InfinitePast();

  mutable Mutex mutex_;
  std::function<void()> wake_ ABSL_GUARDED_BY(mutex_) = [] {};
  bool ends_ ABSL_GUARDED_BY(mutex_) = false;
  FrameQueue queue_ ABSL_GUARDED_BY(mutex_);
  FrameCounts counts_ ABSL_GUARDED_BY(mutex_);
  std::unique_ptr<grpc::ClientContext> context_;  // Written under the lock by the steps alone.
  bool is_broken_ ABSL_GUARDED_BY(mutex_) = false;
  // Most frames without acknowledgement; 0 until the worker has answered the opening.
  size_t window_ ABSL_GUARDED_BY(mutex_) = 0;
  SteadyTime heard_ ABSL_GUARDED_BY(mutex_) = SteadyTime::InfinitePast();
  bool is_away_ ABSL_GUARDED_BY(mutex_) = true;  // No frame was acknowledged since a problem.
};

absl::StatusOr<std::unique_ptr<FrameSender>> FrameSender::Start(FrameSenderOptions options) {
  std::unique_ptr<FrameSender> sender(new FrameSender(std::make_unique<Loop>(std::move(options))));
  HYPERMAP_ASSIGN_OR_RETURN(sender->running_,
                            ThreadExecutor().Start("hm-ros2-sender", [loop = sender->loop_.get()] {
                              return loop->Step();
                            }));
  sender->loop_->SetWake([running = sender->running_.get()] { running->Wake(); });
  return sender;
}

FrameSender::FrameSender(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}

FrameSender::~FrameSender() {
  if (running_ == nullptr) return;
  loop_->End();
  running_->Wake();
  running_->Join();
}

void FrameSender::Send(v1::RobotFrame frame) {
  loop_->Send(std::move(frame));
  running_->Wake();
}

FrameCounts FrameSender::counts() const { return loop_->counts(); }
int64_t FrameSender::num_kept() const { return loop_->num_kept(); }

}  // namespace hypermap::ros2
