#include "server/services/observe_call.h"

#include <utility>

#include "base/status/status_macros.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/wanted.h"
#include "wire/ingest.h"
#include "wire/observation.h"

namespace hypermap::server {

ObserveCall::ObserveCall(grpc::CallbackServerContext* context, const Facilities* facilities)
    : context_(context),
      facilities_(facilities),
      ticket_(facilities->budgets, context),
      log_(*context, "Observe", "") {
  if (ticket_.admitted().ok()) {
    StartRead(&read_);
    return;
  }
  Change([this] {
    mutex_.AssertHeld();
    reading_ = false;
    status_ = ticket_.admitted();
  });
}

void ObserveCall::OnReadDone(bool ok) {
  Change([&] {
    mutex_.AssertHeld();
    reading_ = false;
    // No work may start on a request that arrives after Finish, because OnDone does not wait for
    // it.
    if (!ok || finished_) {
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
    // The opening waits for the disk, which must not occupy the threads for short tasks.
    WorkerPool& workers = opened_ ? facilities_->workers->writes : facilities_->workers->openings;
    grpc::ByteBuffer bytes;
    bytes.Swap(&read_);
    workers.Run(log_.client(), [this, bytes] {
      TakeRequest(bytes);
      // Until here the call neither ends nor reads the next request.
      Change([this] {
        mutex_.AssertHeld();
        taking_ = false;
      });
    });
  });
}

absl::Status ObserveCall::ChargeRequest() {
  ticket_.Received(read_);
  const RequestSize size = {
      static_cast<int64_t>(read_.Length()),
      CallTicket::CostOfRequest(v1::ObserveRequest::default_instance(), read_)};
  HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeRequest(size.cost));
  request_sizes_.push_back(size);
  unanswered_bytes_ += size.bytes;
  return absl::OkStatus();
}

void ObserveCall::FreeRequest() {
  ticket_.FreeMemory(request_sizes_.front().cost);
  unanswered_bytes_ -= request_sizes_.front().bytes;
  request_sizes_.pop_front();
}

void ObserveCall::OnWriteDone(bool ok) {
  Change([&] {
    mutex_.AssertHeld();
    writing_ = false;
    if (!ok && status_.ok()) status_ = absl::CancelledError("the caller went away");
  });
}

void ObserveCall::OnCancel() {
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
    if (status.ok() && !opened_) status = absl::InvalidArgumentError("the stream was not opened");
    acknowledged = acknowledged_;
  }
  if (!ends) return;
  log_.Finished(status, acknowledged);
  // Without the lock, because gRPC may call OnDone, which deletes this, at any time from here on.
  const grpc::Status encoded = ticket_.Encode(status);
  Finish(encoded);
}

bool ObserveCall::GoOn() {
  if (finished_) return false;
  if (status_.ok() && !reading_ && !taking_ && !no_more_reads_ && in_flight_ < kMaxInFlight &&
      unanswered_bytes_ < kMaxUnansweredBytes) {
    reading_ = true;
    StartRead(&read_);
  }
  if (writing_) return false;
  if (has_next_ && status_.ok()) {
    const grpc::Slice slice = Serialize(next_);
    grpc::ByteBuffer(&slice, 1).Swap(&written_);
    next_.Clear();
    has_next_ = false;
    writing_ = true;
    StartWrite(&written_);
    return false;
  }
  finished_ = (!status_.ok() || no_more_reads_) && !taking_ && in_flight_ == 0;
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
  v1::ObserveRequest request;
  absl::Status status = CheckWanted(*context_);
  if (status.ok()) status = ParseRequest(bytes, &request);
  if (!status.ok()) return EndRequest(status);
  if (session_ != nullptr && request.has_opening()) {
    return EndRequest(absl::InvalidArgumentError("opening may come once, in the first request"));
  }
  if (session_ == nullptr) {
    if (!request.has_opening()) {
      return EndRequest(absl::InvalidArgumentError("the first request must carry the opening"));
    }
    if (absl::Status status = Open(request.opening()); !status.ok()) return EndRequest(status);
  }
  if (request.observations().empty()) return EndRequest(absl::OkStatus());
  Submit(request);
}

absl::StatusOr<storage::Receipt> ObserveCall::Start(const v1::ObserveOpening& opening) {
  HYPERMAP_ASSIGN_OR_RETURN(author_, log_.author());
  return session_->RunAndWait(FusionSubmission{
      StartFusion{opening.layer(),
                  {opening.strategy(), opening.parameters(), opening.exploration_layer()}},
      author_, ""});
}

absl::Status ObserveCall::Open(const v1::ObserveOpening& opening) {
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session,
                            FindMap(*facilities_, opening.map()));
  log_.set_map(opening.map());
  session_ = std::move(session);
  layer_ = opening.layer();
  HYPERMAP_RETURN_IF_ERROR(Start(opening).status());
  OpenedLayer opened;
  absl::Status status = session_->InspectFusion(layer_, [&](FusedLayer& fused) -> absl::Status {
    const storage::FusionSettings& settings = fused.settings();
    opened = {settings.strategy,
              settings.parameters,
              settings.exploration_layer,
              {},
              session_->incarnation()};
    if (opening.robot().empty()) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<int64_t> known,
                              fused.log().Sequences(opening.robot()));
    opened.known = RangesOf(known);
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  Change([&] {
    mutex_.AssertHeld();
    wire::EncodeOpened(opened, next_.mutable_opened());
    has_next_ = true;
    opened_ = true;
  });
  return absl::OkStatus();
}

void ObserveCall::Submit(const v1::ObserveRequest& request) {
  std::vector<ObservationVerdict> invalid;
  ObservationSubmission submission{layer_, {}, author_};
  for (const v1::Observation& message : request.observations()) {
    absl::StatusOr<Observation> observation =
        wire::DecodeObservation("", message, facilities_->limits);
    if (observation.ok()) {
      submission.observations.push_back(*std::move(observation));
    } else {
      invalid.push_back(wire::InvalidVerdict(message, observation.status()));
    }
  }
  session_->Observe(std::move(submission),
                    [this, invalid = std::move(invalid)](
                        const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts) mutable {
                      Answer(verdicts, std::move(invalid));
                    });
}

void ObserveCall::Answer(const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts,
                         std::vector<ObservationVerdict> invalid) {
  if (!verdicts.ok()) return EndRequest(verdicts.status());
  {
    MutexLock lock(&mutex_);
    for (const ObservationVerdict& verdict : *verdicts) {
      wire::EncodeVerdict(verdict, next_.add_acknowledgements());
    }
    for (ObservationVerdict& verdict : invalid) {
      verdict.revision = session_->snapshot()->revision;
      wire::EncodeVerdict(verdict, next_.add_acknowledgements());
    }
    acknowledged_ += static_cast<int64_t>(verdicts->size() + invalid.size());
    has_next_ = true;
  }
  EndRequest(absl::OkStatus());
}

}  // namespace hypermap::server
