#include "ingest/frame_service/frame_call.h"

#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/admission/client_host.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"
#include "wire/status.h"

namespace hypermap::ingest {
namespace {

// Memory for a frame in work: depth, points, normals, masks and what segmentation makes of them.
constexpr int64_t kBytesPerPixel = 64;

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

}  // namespace

FrameCall::FrameCall(std::shared_ptr<FrameCalls> calls, absl::string_view client)
    : calls_(std::move(calls)), memory_(&calls_->memory, admission::HostOfPeer(client)) {
  StartRead(&request_);
}

void FrameCall::OnReadDone(bool ok) {
  if (!ok) {
    {
      const MutexLock lock(&mutex_);
      input_ended_ = true;
      may_pop_.NotifyOne();
      if (opened_) return;  // The thread ends the call.
    }
    End(absl::InvalidArgumentError("the stream ended before its opening"));
    return;
  }
  absl::Status opening;
  {
    const MutexLock lock(&mutex_);
    // Requests that arrive while the call ends are not answered.
    if (end_) return;
    if (opened_) {
      if (request_.has_opening()) {
        Acknowledge(request_.frame().sequence(), v1::FRAME_OUTCOME_INVALID, 0,
                    "opening: only the first request has one");
      } else if (!request_.has_frame()) {
        Acknowledge(0, v1::FRAME_OUTCOME_INVALID, 0, "frame is missing");
      } else {
        Push(std::move(*request_.mutable_frame()));
      }
      read_paused_ = Full() && !drop_oldest_;
      if (!read_paused_) StartRead(&request_);
      return;
    }
    opening = Open();
  }
  // After a valid opening, the thread may have ended the call and deleted this object.
  if (!opening.ok()) End(opening);
}

absl::Status FrameCall::Open() {
  if (!request_.has_opening()) {
    return absl::InvalidArgumentError("the first request has no opening");
  }
  HYPERMAP_ASSIGN_OR_RETURN(source_, DecodeOpening(request_.opening()));
  // Charged before the first frame is decoded.
  const int64_t pixels = int64_t{source_.camera.width} * source_.camera.height;
  HYPERMAP_RETURN_IF_ERROR(memory_.Add(pixels * kBytesPerPixel));
  opened_ = true;
  drop_oldest_ = request_.opening().drop_oldest();
  {
    const MutexLock count(&calls_->mutex);
    ++calls_->running;
  }
  absl::StatusOr<std::thread> thread =
      StartThread([call = this, calls = calls_] { Run(call, calls); });
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
      StartThread([this, &upstream] { PassAcknowledgements(**upstream); });
  if (acknowledgements.ok()) {
    Work(**upstream);
    (*upstream)->WritesDone();
    acknowledgements->join();
  }
  const MutexLock lock(&mutex_);
  upstream_ = nullptr;
  HYPERMAP_RETURN_IF_ERROR(acknowledgements.status());
  return (*upstream)->status();
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
  StartRead(&request_);
}

void FrameCall::Work(client::ObserveStream& upstream) {
  while (const std::optional<v1::RobotFrame> message = Pop()) {
    int bad_instances = 0;
    const absl::StatusOr<Frame> frame =
        DecodeFrame(source_, *message, calls_->options.max_instances, bad_instances);
    const absl::StatusOr<Observation> observation =
        frame.ok() ? calls_->observer->Observe(*frame, nullptr)
                   : absl::StatusOr<Observation>(frame.status());
    {
      const MutexLock lock(&mutex_);
      if (bad_instances > 0) bad_instances_[message->sequence()] = bad_instances;
      if (!observation.ok()) {
        Acknowledge(message->sequence(), v1::FRAME_OUTCOME_INVALID, 0,
                    std::string(observation.status().message()));
        continue;
      }
    }
    if (!upstream.Write(*observation)) return;
  }
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

std::optional<v1::RobotFrame> FrameCall::Pop() {
  const MutexLock lock(&mutex_);
  while (!MayPop()) may_pop_.Wait(&mutex_);
  if (queue_.empty() || upstream_ended_ || cancelled_) return std::nullopt;
  v1::RobotFrame frame = std::move(queue_.front());
  queue_.pop_front();
  if (std::exchange(read_paused_, false)) StartRead(&request_);
  return frame;
}

bool FrameCall::Full() const { return queue_.size() >= static_cast<size_t>(calls_->options.queue); }

void FrameCall::Push(v1::RobotFrame frame) {
  if (Full()) {
    Acknowledge(queue_.front().sequence(), v1::FRAME_OUTCOME_DROPPED, 0, "the queue was full");
    queue_.pop_front();
  }
  queue_.push_back(std::move(frame));
  may_pop_.NotifyOne();
}

v1::FrameAcknowledgement* FrameCall::Add(int64_t sequence, v1::FrameOutcome outcome,
                                         Revision revision, const std::string& message) {
  v1::FrameAcknowledgement* acknowledgement = waiting_.add_acknowledgements();
  acknowledgement->set_sequence(sequence);
  acknowledgement->set_outcome(outcome);
  acknowledgement->set_revision(revision);
  acknowledgement->set_message(message);
  if (const auto bad = bad_instances_.find(sequence); bad != bad_instances_.end()) {
    acknowledgement->set_bad_instances(bad->second);
    bad_instances_.erase(bad);
  }
  return acknowledgement;
}

void FrameCall::Acknowledge(int64_t sequence, v1::FrameOutcome outcome, Revision revision,
                            const std::string& message) {
  Add(sequence, outcome, revision, message);
  Flush();
}

void FrameCall::Flush() {
  if (writing_ || finished_) return;
  if (waiting_.has_opened() || !waiting_.acknowledgements().empty()) {
    sending_ = std::move(waiting_);
    waiting_.Clear();
    writing_ = true;
    StartWrite(&sending_);
  } else if (end_ && !finished_) {
    finished_ = true;
    Finish(wire::EncodeStatus(*end_));
  }
}

void FrameCall::OnWriteDone(bool ok) {
  const MutexLock lock(&mutex_);
  writing_ = false;
  if (!ok) waiting_.Clear();  // The robot is gone.
  Flush();
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
  end_ = status;
  Flush();
}

}  // namespace hypermap::ingest
