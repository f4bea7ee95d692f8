#include "simulation/robots/observation_sender.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"

namespace hypermap::robots {
namespace {

// A few unacknowledged observations keep the server busy; it would accept some hundreds.
constexpr size_t kMostPending = 8;
constexpr absl::Duration kBetweenAttempts = absl::Milliseconds(200);

}  // namespace

ObservationSender::ObservationSender(client::Client& client, Target target, absl::Duration patience,
                                     std::function<bool()> is_interrupted)
    : client_(client),
      target_(std::move(target)),
      patience_(patience),
      is_interrupted_(std::move(is_interrupted)) {}

absl::Status ObservationSender::Open() {
  HYPERMAP_RETURN_IF_ERROR(OpenOnce());
  for (const client::SequenceRange& range : stream_->opened().known) {
    next_sequence_ = std::max(next_sequence_, range.last + 1);
  }
  return absl::OkStatus();
}

absl::Status ObservationSender::OpenOnce() {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<client::ObserveStream> stream,
                            client_.Observe(target_.map, target_.layer, target_.options));
  stream_ = std::move(stream);
  return absl::OkStatus();
}

absl::Status ObservationSender::Send(Observation observation) {
  while (pending_.size() >= kMostPending) {
    HYPERMAP_RETURN_IF_ERROR(AwaitOne());
  }
  const int64_t sequence = next_sequence_++;
  const auto [it, is_new] = pending_.emplace(sequence, std::move(observation));
  // A broken stream is noticed, and reopened, when the next acknowledgement is awaited.
  if (is_new) stream_->Write(it->second);
  return absl::OkStatus();
}

absl::Status ObservationSender::Flush() {
  while (!pending_.empty()) {
    HYPERMAP_RETURN_IF_ERROR(AwaitOne());
  }
  return absl::OkStatus();
}

absl::Status ObservationSender::AwaitOne() {
  const std::optional<client::Acknowledgement> acknowledgement = stream_->Read();
  if (acknowledgement) return Note(*acknowledgement);
  const absl::Status status = stream_->status();
  // A stream that ends with OK before all is acknowledged belongs to a server that is stopping.
  if (!status.ok() && !absl::IsUnavailable(status)) return status;
  return Reopen();
}

absl::Status ObservationSender::Reopen() {
  const absl::Time end = absl::Now() + patience_;
  absl::Status status;
  while (true) {
    status = OpenOnce();
    if (status.ok() || !absl::IsUnavailable(status) || absl::Now() >= end) break;
    if (is_interrupted_()) return absl::CancelledError("interrupted");
    absl::SleepFor(kBetweenAttempts);
  }
  HYPERMAP_RETURN_IF_ERROR(status);
  for (const auto& [sequence, observation] : pending_) {
    if (!stream_->Write(observation)) break;
  }
  return absl::OkStatus();
}

absl::Status ObservationSender::Note(const client::Acknowledgement& acknowledgement) {
  using Outcome = client::ObservationOutcome;
  if (pending_.erase(acknowledgement.sequence) == 0) return absl::OkStatus();
  if (acknowledgement.outcome == Outcome::kAccepted ||
      acknowledgement.outcome == Outcome::kDuplicate) {
    ++num_accepted_;
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat("observation ", acknowledgement.sequence, " of ", acknowledgement.robot, " is ",
                   std::string(client::ObservationOutcomeName(acknowledgement.outcome)), ": ",
                   acknowledgement.message));
}

}  // namespace hypermap::robots
