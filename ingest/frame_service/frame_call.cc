#include "ingest/frame_service/frame_call.h"

#include <grpcpp/support/proto_buffer_reader.h>
#include <grpcpp/support/slice.h>

#include <thread>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "base/admission/client_host.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"
#include "wire/message_memory.h"
#include "wire/status.h"

namespace hypermap::ingest {
namespace {

// Memory of the depth image: the rows of the PNG and the depth in metres.
constexpr int64_t kDepthBytesPerPixel = 8;

v1::FrameOutcome OutcomeOf(client::ObservationOutcome outcome) {
  switch (outcome) {
    case client::ObservationOutcome::kAccepted:
      return v1::FRAME_OUTCOME_ACCEPTED;
    case client::ObservationOutcome::kDuplicate:
      return v1::FRAME_OUTCOME_DUPLICATE;
    case client::ObservationOutcome::kRefusedLate:
      return v1::FRAME_OUTCOME_REFUSED_LATE;
    case client::ObservationOutcome::kInvalid:
      return v1::FRAME_OUTCOME_INVALID;
    case client::ObservationOutcome::kConflict:
      return v1::FRAME_OUTCOME_CONFLICT;
  }
  return v1::FRAME_OUTCOME_UNSPECIFIED;
}

bool Parse(const grpc::ByteBuffer& bytes, v1::StreamFramesRequest& request) {
  if (!bytes.Valid()) return false;
  // The reader does not change the buffer.
  grpc::ProtoBufferReader reader(const_cast<grpc::ByteBuffer*>(&bytes));
  return request.ParseFromZeroCopyStream(&reader);
}

}  // namespace

FrameCalls::FrameCalls(const FrameServerOptions& served, const client::Client& upstream,
                       std::shared_ptr<const Observer> perception)
    : options(served),
      client(upstream),
      observer(std::move(perception)),
      memory("memory_limit", served.memory_limit),
      streams("max_streams", served.max_streams, {.unit = "streams"}),
      refusals([log = served.log](const admission::Refusals::Line& line) {
        log(absl::StrCat("streams are refused: ", line.flag, ", ", line.count,
                         " since the start; the last: ", absl::CEscape(line.message)));
      }) {}

FrameCall::FrameCall(std::shared_ptr<FrameCalls> calls, absl::string_view client)
    : calls_(std::move(calls)),
      stream_(&calls_->streams, admission::HostOfPeer(client)),
      memory_(&calls_->memory, admission::HostOfPeer(client)) {
  const MutexLock lock(&mutex_);
  const absl::Status admitted = stream_.Add(1);
  if (admitted.ok()) {
    reading_ = true;
    StartRead(&request_);
  } else {
    EndLocked(admitted);
  }
}

void FrameCall::OnReadDone(bool ok) {
  absl::Status status;
  if (ok) {
    status = TakeRequest();
    if (status.ok()) return;
  }
  const MutexLock lock(&mutex_);
  reading_ = false;
  input_ended_ = true;
  input_status_ = status;
  may_pop_.NotifyOne();
  if (opened_) return;  // The thread ends the call.
  EndLocked(ok ? status : absl::InvalidArgumentError("the stream ended before its opening"));
}

absl::Status FrameCall::TakeRequest() {
  const auto received = static_cast<int64_t>(request_.Length());
  const int64_t parsed =
      wire::MemoryOfMessage(v1::StreamFramesRequest::default_instance(), request_);
  HYPERMAP_RETURN_IF_ERROR(Charge(received + parsed));
  v1::StreamFramesRequest request;
  const bool is_request = Parse(request_, request);
  request_.Clear();
  const MutexLock lock(&mutex_);
  if (finished_) return absl::OkStatus();  // The end gave back all memory.
  memory_.GiveBack(received);
  if (!is_request) return absl::InvalidArgumentError("the request is not a StreamFramesRequest");
  reading_ = false;
  if (!opened_) {
    absl::Status status = Open(request);
    memory_.GiveBack(parsed);
    return status;
  }
  // Requests that arrive while the call ends are not answered.
  if (!end_) TakeFrame(request, parsed);
  ReadOn();
  return absl::OkStatus();
}

void FrameCall::TakeFrame(v1::StreamFramesRequest& request, int64_t bytes) {
  if (!request.has_opening() && request.has_frame()) {
    return Push({std::move(*request.mutable_frame()), bytes});
  }
  Acknowledge(
      request.frame().sequence(), v1::FRAME_OUTCOME_INVALID,
      request.has_opening() ? "opening: only the first request has one" : "frame is missing");
  memory_.GiveBack(bytes);
}

absl::Status FrameCall::Open(const v1::StreamFramesRequest& request) {
  if (!request.has_opening()) {
    return absl::InvalidArgumentError("the first request has no opening");
  }
  HYPERMAP_ASSIGN_OR_RETURN(source_, DecodeOpening(request.opening()));
  // Charged before the first frame is decoded.
  const int64_t pixels = int64_t{source_.camera.width} * source_.camera.height;
  const int64_t bytes = pixels * (kDepthBytesPerPixel + calls_->observer->bytes_per_pixel());
  HYPERMAP_RETURN_IF_ERROR(memory_.Add(bytes));
  bytes_of_camera_ = bytes;
  opened_ = true;
  drop_oldest_ = request.opening().drop_oldest();
  {
    const MutexLock count(&calls_->mutex);
    ++calls_->running;
  }
  absl::StatusOr<std::thread> thread =
      StartThread("hm-frames", [call = this, calls = calls_] { Run(call, calls); });
  if (thread.ok()) {
    thread->detach();
    return absl::OkStatus();
  }
  opened_ = false;
  const MutexLock count(&calls_->mutex);
  --calls_->running;
  return thread.status();
}

void FrameCall::Run(FrameCall* call, const std::shared_ptr<FrameCalls>& calls) {
  const absl::Status status = call->Serve();
  call->End(status);  // May delete the call.
  const MutexLock lock(&calls->mutex);
  --calls->running;
  calls->ended.NotifyAll();
}

absl::Status FrameCall::Serve() {
  client::ObserveOptions observe = calls_->options.observe;
  observe.robot = source_.robot;
  absl::StatusOr<std::unique_ptr<client::ObserveStream>> upstream =
      calls_->client.Observe(calls_->options.map, calls_->options.layer, observe);
  HYPERMAP_RETURN_IF_ERROR(upstream.status());
  {
    const MutexLock lock(&mutex_);
    if (cancelled_) return absl::CancelledError("");
    upstream_ = upstream->get();
  }
  TellOpened((*upstream)->opened());
  absl::StatusOr<std::thread> acknowledgements =
      StartThread("hm-frame-acks", [this, &upstream] { PassAcknowledgements(**upstream); });
  absl::Status worked = acknowledgements.status();
  if (acknowledgements.ok()) {
    worked = Work(**upstream);
    (*upstream)->WritesDone();
    acknowledgements->join();
  }
  const MutexLock lock(&mutex_);
  upstream_ = nullptr;
  HYPERMAP_RETURN_IF_ERROR(worked);
  HYPERMAP_RETURN_IF_ERROR((*upstream)->status());
  return input_status_;
}

void FrameCall::TellOpened(const client::OpenedLayer& opened) {
  const MutexLock lock(&mutex_);
  v1::FramesOpened* message = waiting_.mutable_opened();
  message->set_queue(calls_->options.queue);
  for (const client::SequenceRange& range : opened.known) {
    v1::KnownFrames* known = message->add_known();
    known->set_first(range.first);
    known->set_last(range.last);
  }
  Flush();
  told_opened_ = true;
  ReadOn();
}

absl::Status FrameCall::CheckWanted() {
  const MutexLock lock(&mutex_);
  return cancelled_ || upstream_ended_ ? absl::CancelledError("the stream ended")
                                       : absl::OkStatus();
}

absl::Status FrameCall::Charge(int64_t bytes, int64_t held) {
  const MutexLock lock(&mutex_);
  const int64_t limit = calls_->options.memory_limit;
  const int64_t together = bytes_of_camera_ + held + bytes;
  if (limit > 0 && together > limit / 2) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the frame would take ", together,
                     " bytes of memory, more than one client may hold, half of --memory_limit, ",
                     limit, " bytes"));
  }
  return memory_.Add(bytes);
}

void FrameCall::Free(int64_t bytes) {
  const MutexLock lock(&mutex_);
  memory_.GiveBack(bytes);
}

absl::Status FrameCall::Work(client::ObserveStream& upstream) {
  Cancellation cancellation([this] { return CheckWanted(); });
  const ScopedCancellation here(&cancellation);
  while (const std::optional<WaitingFrame> next = Pop()) {
    const int64_t bytes = MemoryOfInstances(source_, next->frame, calls_->options.max_instances);
    if (absl::Status status = Charge(bytes, next->bytes); !status.ok()) {
      if (admission::IsTryLater(status)) return status;
      // The frame would not be accepted later, either.
      calls_->refusals.Count(status);
      const MutexLock lock(&mutex_);
      memory_.GiveBack(next->bytes);
      Acknowledge(next->frame.sequence(), v1::FRAME_OUTCOME_INVALID,
                  absl::StrCat("frame.instances: ", status.message()));
      continue;
    }
    if (!Process(next->frame, upstream)) break;
    Free(bytes + next->bytes);
  }
  return absl::OkStatus();
}

bool FrameCall::Process(const v1::RobotFrame& frame, client::ObserveStream& upstream) {
  int bad_instances = 0;
  const absl::StatusOr<Observation> observation = Observe(frame, bad_instances);
  if (absl::IsCancelled(observation.status())) return false;
  {
    const MutexLock lock(&mutex_);
    if (bad_instances > 0) bad_instances_[frame.sequence()] = bad_instances;
    if (!observation.ok()) {
      Acknowledge(frame.sequence(), v1::FRAME_OUTCOME_INVALID,
                  std::string(observation.status().message()));
      return true;
    }
  }
  return upstream.Write(*observation);
}

absl::StatusOr<Observation> FrameCall::Observe(const v1::RobotFrame& frame,
                                               int& bad_instances) const {
  HYPERMAP_ASSIGN_OR_RETURN(
      const Frame decoded,
      DecodeFrame(source_, frame, calls_->options.max_instances, bad_instances));
  return calls_->observer->Observe(decoded, nullptr);
}

void FrameCall::PassAcknowledgements(client::ObserveStream& upstream) {
  while (const std::optional<client::Acknowledgement> a = upstream.Read()) {
    const MutexLock lock(&mutex_);
    v1::FrameAcknowledgement* const added =
        Add(a->sequence, OutcomeOf(a->outcome), a->revision, a->message);
    if (a->clock_skew_s) added->set_clock_skew_s(*a->clock_skew_s);
    Flush();
  }
  const MutexLock lock(&mutex_);
  upstream_ended_ = true;
  may_pop_.NotifyOne();
}

bool FrameCall::MayPop() const {
  return !queue_.empty() || input_ended_ || upstream_ended_ || cancelled_;
}

std::optional<FrameCall::WaitingFrame> FrameCall::Pop() {
  const MutexLock lock(&mutex_);
  while (!MayPop()) may_pop_.Wait(&mutex_);
  if (queue_.empty() || upstream_ended_ || cancelled_) return std::nullopt;
  WaitingFrame oldest = TakeOldest();
  ReadOn();
  return oldest;
}

FrameCall::WaitingFrame FrameCall::TakeOldest() {
  WaitingFrame oldest = std::move(queue_.front());
  queue_.pop_front();
  queued_bytes_ -= oldest.bytes;
  return oldest;
}

bool FrameCall::Full() const {
  return queue_.size() >= static_cast<size_t>(calls_->options.queue) ||
         queued_bytes_ >= calls_->options.max_queue_bytes;
}

void FrameCall::ReadOn() {
  const bool waits =
      (Full() && !drop_oldest_) || waiting_.acknowledgements_size() >= kMaxWaitingAcknowledgements;
  if (!told_opened_ || reading_ || waits || input_ended_ || end_) return;
  reading_ = true;
  StartRead(&request_);
}

void FrameCall::Push(WaitingFrame waiting) {
  while (Full()) {
    const WaitingFrame oldest = TakeOldest();
    memory_.GiveBack(oldest.bytes);
    Acknowledge(oldest.frame.sequence(), v1::FRAME_OUTCOME_DROPPED, "the queue was full");
  }
  queued_bytes_ += waiting.bytes;
  queue_.push_back(std::move(waiting));
  may_pop_.NotifyOne();
}

v1::FrameAcknowledgement* FrameCall::Add(int64_t sequence, v1::FrameOutcome outcome,
                                         Revision revision, const std::string& message) {
  v1::FrameAcknowledgement* acknowledgement = waiting_.add_acknowledgements();
  acknowledgement->set_sequence(sequence);
  acknowledgement->set_outcome(outcome);
  acknowledgement->set_revision(revision);
  // Cut like the messages of errors, because it may repeat text of the robot.
  acknowledgement->set_message(wire::EncodeStatus(absl::UnknownError(message)).error_message());
  if (const auto bad = bad_instances_.find(sequence); bad != bad_instances_.end()) {
    acknowledgement->set_bad_instances(bad->second);
    bad_instances_.erase(bad);
  }
  return acknowledgement;
}

void FrameCall::Acknowledge(int64_t sequence, v1::FrameOutcome outcome,
                            const std::string& message) {
  Add(sequence, outcome, 0, message);
  Flush();
}

void FrameCall::Flush() {
  if (writing_ || finished_) return;
  if (waiting_.has_opened() || !waiting_.acknowledgements().empty()) {
    const grpc::Slice slice(waiting_.SerializeAsString());
    grpc::ByteBuffer(&slice, 1).Swap(&sending_);
    waiting_ = {};
    writing_ = true;
    StartWrite(&sending_);
  } else if (end_ && !finished_) {
    finished_ = true;
    // Before the robot learns of the end, and may open another stream.
    queue_.clear();
    memory_.GiveBack();
    stream_.GiveBack();
    Finish(wire::EncodeStatus(*end_));
  }
}

void FrameCall::OnWriteDone(bool ok) {
  const MutexLock lock(&mutex_);
  writing_ = false;
  if (!ok) waiting_.Clear();  // The robot is gone.
  Flush();
  ReadOn();
}

void FrameCall::OnCancel() {
  const MutexLock lock(&mutex_);
  cancelled_ = true;
  may_pop_.NotifyOne();
  if (upstream_ != nullptr) upstream_->Cancel();
}

void FrameCall::OnDone() {
  { const MutexLock lock(&mutex_); }  // The thread that called Finish() may still hold the mutex.
  delete this;
}

void FrameCall::End(const absl::Status& status) {
  const MutexLock lock(&mutex_);
  EndLocked(status);
}

void FrameCall::EndLocked(const absl::Status& status) {
  calls_->refusals.Count(status);
  end_ = status;
  Flush();
}

}  // namespace hypermap::ingest
