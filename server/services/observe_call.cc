#include "server/services/observe_call.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "base/sync/cancel_scope.h"
#include "server/rpc/raw_messages.h"
#include "wire/ingest.h"
#include "wire/observation.h"

namespace hypermap::server {
namespace {

// Estimated memory of an acknowledgement besides the name of its robot: the verdict, the message,
// its encoded form, and a reason.
constexpr int64_t kBytesOfAcknowledgement = 512;

int64_t BytesOfAcknowledgements(const v1::ObserveRequest& request) {
  int64_t bytes = 0;
  for (const v1::Observation& observation : request.observations()) {
    bytes += kBytesOfAcknowledgement + 2 * static_cast<int64_t>(observation.robot().size());
  }
  return bytes;
}

// Decoding larger requests takes long.
constexpr size_t kFewBytes = 64 << 10;

// Estimated memory of a range of known sequences: its message in a list that grows by doubling, and
// its encoded form.
constexpr int64_t kBytesOfKnownRange = 96;

int64_t BytesOfOpened(const OpenedLayer& opened) {
  const size_t texts =
      opened.strategy.size() + opened.parameters.size() + opened.exploration_layer.size();
  return 2 * static_cast<int64_t>(texts) +
         kBytesOfKnownRange * static_cast<int64_t>(opened.known.size());
}

// The part of the answers' bytes that is charged.
int64_t Charged(int64_t bytes) {
  return std::max<int64_t>(0, bytes - CallTicket::kFreeAnswerBytes);
}

}  // namespace

ObserveCall::ObserveCall(grpc::CallbackServerContext* context, const Facilities* facilities,
                         OpenStreams* open)
    : facilities_(facilities),
      open_(open),
      context_(facilities->for_calls(), context, Rpc::kObserve),
      ticket_(context_.ticket()) {
  absl::Status status = context_.admitted();
  if (status.ok()) {
    StartRead(&read_);
    if (open_->Add(this)) return;
    status = ServerStops();
  }
  Change([&] {
    mutex_.AssertHeld();
    reading_ = false;
    status_ = std::move(status);
  });
}

void ObserveCall::EndSoon() {
  Change([this] {
    mutex_.AssertHeld();
    stopping_ = true;
  });
  if (ForwardedStream* const forwarded = this->forwarded()) forwarded->Stop(ServerStops());
}

void ObserveCall::OnReadDone(bool ok) {
  if (ForwardedStream* const forwarded = this->forwarded()) {
    if (ok) ticket_.Received(*forwarded_read_);
    return forwarded->OnCallerRead(ok);
  }
  Change([&] {
    mutex_.AssertHeld();
    reading_ = false;
    // No work may start on a request that arrives after Finish, because OnDone does not wait for
    // it.
    if (!ok || finished_ || stopping_) {
      no_more_reads_ = true;
      return;
    }
    if (absl::Status status = ChargeRequest(); !status.ok()) {
      no_more_reads_ = true;
      if (status_.ok()) status_ = std::move(status);
      return;
    }
    ++in_flight_;
    taking_ = true;
    WorkerPools& workers = *facilities_->workers;
    WorkerPool& pool = read_.Length() > kFewBytes ? workers.long_writes : workers.writes;
    grpc::ByteBuffer bytes;
    bytes.Swap(&read_);
    pool.Run(context_.origin(), [this, bytes] { TakeRequest(bytes); });
  });
}

absl::Status ObserveCall::ChargeRequest() {
  ticket_.Received(read_);
  const RequestSize size = {
      static_cast<int64_t>(read_.Length()),
      CallTicket::CostOnArrival(v1::ObserveRequest::default_instance(), read_)};
  HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeRequest(size.cost));
  request_sizes_.push_back(size);
  unanswered_bytes_ += size.bytes;
  return absl::OkStatus();
}

absl::Status ObserveCall::ChargeRest(const grpc::ByteBuffer& bytes) {
  if (IsSmallRequest(bytes)) return absl::OkStatus();
  const int64_t cost = CallTicket::CostOfRequest(v1::ObserveRequest::default_instance(), bytes);
  const MutexLock lock(&mutex_);
  // No other is read while this one is taken.
  RequestSize& size = request_sizes_.back();
  ticket_.FreeMemory(std::exchange(size.cost, 0));
  HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeRequest(cost));
  size.cost = cost;
  return absl::OkStatus();
}

void ObserveCall::FreeRequest() {
  ticket_.FreeMemory(request_sizes_.front().cost);
  unanswered_bytes_ -= request_sizes_.front().bytes;
  request_sizes_.pop_front();
}

absl::Status ObserveCall::ChargeAnswer(int64_t bytes) {
  const MutexLock lock(&mutex_);
  HYPERMAP_RETURN_IF_ERROR(
      ticket_.ChargeMemory(Charged(unwritten_bytes_ + bytes) - Charged(unwritten_bytes_)));
  unwritten_bytes_ += bytes;
  return absl::OkStatus();
}

void ObserveCall::FreeAnswer(int64_t bytes) {
  ticket_.FreeMemory(Charged(unwritten_bytes_) - Charged(unwritten_bytes_ - bytes));
  unwritten_bytes_ -= bytes;
}

void ObserveCall::OnWriteDone(bool ok) {
  if (ForwardedStream* const forwarded = this->forwarded()) return forwarded->OnCallerWritten(ok);
  Change([&] {
    mutex_.AssertHeld();
    writing_ = false;
    written_.Clear();
    FreeAnswer(std::exchange(written_bytes_, 0));
    if (!ok && status_.ok()) status_ = absl::CancelledError("the caller went away");
  });
}

void ObserveCall::OnCancel() {
  const CancelScope in_cancel(this);
  Change([&] {
    mutex_.AssertHeld();
    if (status_.ok()) status_ = absl::CancelledError("the caller went away");
  });
}

void ObserveCall::Change(absl::FunctionRef<void()> change) {
  bool ends = false;
  absl::Status status;
  int64_t acknowledged = 0;
  {
    MutexLock lock(&mutex_);
    change();
    ends = GoOn();
    status = status_;
    if (status.ok() && stopping_) status = ServerStops();
    if (status.ok() && !opened_) status = absl::InvalidArgumentError("the stream was not opened");
    acknowledged = acknowledged_;
  }
  if (!ends || PassOn(status)) return;
  // Without the lock, because gRPC may call OnDone, which deletes this, at any time from here on.
  const grpc::Status encoded = context_.End(status, acknowledged);
  Finish(encoded);
}

bool ObserveCall::PassOn(const absl::Status& error) {
  // Once the stream is open, its client must open it anew: it knows which answers it has.
  if (first_.Length() == 0) return false;
  std::optional<Forwarding> forwarding = context_.ForwardInsteadOf(error);
  if (!forwarding) return false;
  ticket_.FreeMemory(ticket_.memory());
  ForwardedStream::Caller* const caller = this;
  ForwardedStream* stream = nullptr;
  {
    const MutexLock lock(&mutex_);
    if (stopping_) return false;
    forwarded_ = std::make_unique<ForwardedStream>(
        caller, &ticket_, ForwardedStream::Requests::kMany, *std::move(forwarding));
    stream = forwarded_.get();
  }
  stream->Start(first_);
  return true;
}

ForwardedStream* ObserveCall::forwarded() {
  const MutexLock lock(&mutex_);
  return forwarded_.get();
}

void ObserveCall::ReadFromCaller(grpc::ByteBuffer* message) {
  forwarded_read_ = message;
  StartRead(message);
}

bool ObserveCall::GoOn() {
  if (finished_) return false;
  if (status_.ok() && !reading_ && !taking_ && !no_more_reads_ && !stopping_ &&
      in_flight_ < kMaxInFlight && unanswered_bytes_ < kMaxUnansweredBytes &&
      unwritten_bytes_ < kMaxUnwrittenBytes) {
    reading_ = true;
    StartRead(&read_);
  }
  if (writing_) return false;
  if (has_next_ && status_.ok()) {
    // Clear would keep the memory of the acknowledgements.
    v1::ObserveResponse response;
    response.Swap(&next_);
    const grpc::Slice slice = Serialize(response);
    grpc::ByteBuffer(&slice, 1).Swap(&written_);
    // Only the encoded form waits for the client.
    written_bytes_ = std::min(next_bytes_, static_cast<int64_t>(slice.size()));
    FreeAnswer(std::exchange(next_bytes_, 0) - written_bytes_);
    has_next_ = false;
    writing_ = true;
    StartWrite(&written_);
    return false;
  }
  finished_ = (!status_.ok() || no_more_reads_ || stopping_) && !taking_ && in_flight_ == 0;
  return finished_;
}

void ObserveCall::EndRequest(absl::Status status) {
  Change([&] {
    mutex_.AssertHeld();
    --in_flight_;
    FreeRequest();
    if (!status.ok() && status_.ok()) status_ = std::move(status);
  });
}

void ObserveCall::TakeRequest(const grpc::ByteBuffer& bytes) {
  if (session_ == nullptr) first_ = bytes;
  auto request = std::make_shared<v1::ObserveRequest>();
  absl::Status status = context_.CheckWanted();
  if (status.ok()) status = ChargeRest(bytes);
  if (status.ok()) {
    status = UnlessMemoryFails([&] { return ParseRequest(bytes, request.get()); });
  }
  if (status.ok() && session_ != nullptr && request->has_opening()) {
    status = absl::InvalidArgumentError("opening may come once, in the first request");
  }
  if (status.ok() && session_ == nullptr && !request->has_opening()) {
    status = absl::InvalidArgumentError("the first request must carry the opening");
  }
  if (!status.ok() || session_ != nullptr) return Took(*request, std::move(status));
  Open(std::move(request));
}

void ObserveCall::Took(const v1::ObserveRequest& request, absl::Status status) {
  if (status.ok() && !request.observations().empty()) {
    Cancellation cancellation([this] { return context_.CheckWanted(); });
    const ScopedCancellation here(&cancellation);
    status = ChargeAnswer(BytesOfAcknowledgements(request));
    if (status.ok()) status = Submit(request);
    if (!status.ok()) EndRequest(std::move(status));
  } else {
    EndRequest(std::move(status));
  }
  // Until here the call neither ends nor reads the next request.
  Change([this] {
    mutex_.AssertHeld();
    taking_ = false;
  });
}

void ObserveCall::Open(std::shared_ptr<const v1::ObserveRequest> request) {
  const v1::ObserveOpening& opening = request->opening();
  if (absl::Status status = context_.EnterMap(opening.map()); !status.ok()) {
    return Took(*request, std::move(status));
  }
  if (absl::Status status = CheckRobot(opening.robot()); !status.ok()) {
    return Took(*request, std::move(status));
  }
  absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(*facilities_, opening.map());
  if (!session.ok()) return Took(*request, session.status());
  absl::StatusOr<std::string> author = context_.author();
  if (!author.ok()) return Took(*request, author.status());
  session_ = *std::move(session);
  layer_ = opening.layer();
  author_ = *std::move(author);
  FusionSubmission start{
      StartFusion{layer_, {opening.strategy(), opening.parameters(), opening.exploration_layer()}},
      author_, ""};
  start.cancellation = context_.MakeCancellation();
  start.client = ticket_.client();
  session_->Run(std::move(start), [this, request = std::move(request)](
                                      const absl::StatusOr<storage::Receipt>& receipt) {
    if (!receipt.ok()) return Took(*request, receipt.status());
    // It waits for the writer, which must occupy neither a thread for short tasks nor more than one
    // of the others.
    facilities_->workers->openings.Run(
        context_.origin(), request->opening().map(),
        [this, request] { Took(*request, TellOpened(request->opening().robot())); });
  });
}

absl::Status ObserveCall::CheckRobot(const std::string& robot) const {
  return robot.empty() ? absl::OkStatus() : context_.caller().CheckRobot(robot);
}

absl::Status ObserveCall::TellOpened(const std::string& robot) {
  Cancellation cancellation([this] { return context_.CheckWanted(); });
  const ScopedCancellation here(&cancellation);
  v1::ObserveOpened message;
  int64_t bytes = 0;
  {
    // Until it is opened, the call neither reads nor writes: nothing else uses the ticket.
    MemoryMeter meter(&ticket_);
    HYPERMAP_ASSIGN_OR_RETURN(const OpenedLayer opened, ReadOpened(robot, &meter));
    bytes = BytesOfOpened(opened);
    HYPERMAP_RETURN_IF_ERROR(ChargeAnswer(bytes));
    wire::EncodeOpened(opened, &message);
  }
  Change([&] {
    mutex_.AssertHeld();
    next_.mutable_opened()->Swap(&message);
    next_bytes_ += bytes;
    has_next_ = true;
    opened_ = true;
    first_.Clear();
  });
  return absl::OkStatus();
}

absl::StatusOr<OpenedLayer> ObserveCall::ReadOpened(const std::string& robot, MemoryMeter* meter) {
  OpenedLayer opened;
  absl::Status status = session_->InspectFusion(layer_, [&](FusedLayer& fused) -> absl::Status {
    const storage::FusionSettings& settings = fused.settings();
    opened = {settings.strategy,
              settings.parameters,
              settings.exploration_layer,
              {},
              session_->incarnation()};
    if (robot.empty()) return absl::OkStatus();
    const ScopedMeter here(meter);
    HYPERMAP_ASSIGN_OR_RETURN(opened.known, fused.log().Sequences(robot));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return opened;
}

absl::Status ObserveCall::Submit(const v1::ObserveRequest& request) {
  std::vector<ObservationVerdict> invalid;
  ObservationSubmission submission{layer_, {}, author_};
  submission.cancellation = context_.MakeCancellation();
  submission.client = ticket_.client();
  for (const v1::Observation& message : request.observations()) {
    HYPERMAP_RETURN_IF_ERROR(CheckRobot(message.robot()));
    absl::StatusOr<Observation> observation =
        wire::DecodeObservation("", message, facilities_->limits);
    // A check that was given up says nothing of the observation.
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (observation.ok()) {
      submission.observations.push_back(*std::move(observation));
    } else {
      invalid.push_back(wire::InvalidVerdict(message, observation.status()));
    }
  }
  session_->Observe(std::move(submission),
                    [this, invalid = std::move(invalid), bytes = BytesOfAcknowledgements(request)](
                        const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts) mutable {
                      Answer(verdicts, std::move(invalid), bytes);
                    });
  return absl::OkStatus();
}

void ObserveCall::Answer(const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts,
                         std::vector<ObservationVerdict> invalid, int64_t bytes) {
  if (!verdicts.ok()) return EndRequest(verdicts.status());
  {
    MutexLock lock(&mutex_);
    for (const ObservationVerdict& verdict : *verdicts) {
      session_->meters().AddObservation(verdict.outcome);
      wire::EncodeVerdict(verdict, next_.add_acknowledgements());
    }
    for (ObservationVerdict& verdict : invalid) {
      session_->meters().AddObservation(verdict.outcome);
      verdict.revision = session_->snapshot()->revision;
      wire::EncodeVerdict(verdict, next_.add_acknowledgements());
    }
    next_bytes_ += bytes;
    acknowledged_ += static_cast<int64_t>(verdicts->size() + invalid.size());
    has_next_ = true;
  }
  EndRequest(absl::OkStatus());
}

}  // namespace hypermap::server
