#include "client_libs/bench/robot_workers.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"

namespace hypermap::bench {
namespace {

// Reason why a stream ended that was expected to go on.
absl::Status EndOf(const absl::Status& status) {
  return status.ok() ? absl::UnavailableError("the server ended the stream") : status;
}

}  // namespace

std::string RobotName(int number) { return absl::StrCat("bench-robot-", number); }

ObserveWorker::ObserveWorker(const Load& load, client::Client client, int robot)
    : PacedWorker(OperationKind::kObservation, load, std::move(client), load.options.observe_hz,
                  RandomRole::kObserve, robot),
      robot_(RobotName(robot)) {}

absl::Status ObserveWorker::Open() { return OpenStream(LongestStream(load().options)); }

absl::Status ObserveWorker::OpenStream(absl::Duration limit) {
  HYPERMAP_ASSIGN_OR_RETURN(stream_, client().Observe(load().options.map, kObjectsLayer,
                                                      {.robot = robot_}, {.timeout = limit}));
  // A run before this one may have used the robot's name.
  const std::vector<client::SequenceRange>& known = stream_->opened().known;
  if (!known.empty()) next_sequence_ = std::max(next_sequence_, known.back().last + 1);
  return absl::OkStatus();
}

void ObserveWorker::Prepare() {
  observation_ = load().site.Observe(robot_, next_sequence_++, absl::Now(), random());
}

absl::StatusOr<SteadyTime> ObserveWorker::Attempt(const RunTimes& times) {
  if (!stream_) HYPERMAP_RETURN_IF_ERROR(OpenStream(times.give_up - SteadyTime::Now()));
  const absl::StatusOr<client::Acknowledgement> answer = Ask();
  const SteadyTime answered = SteadyTime::Now();
  if (!answer.ok()) {
    stream_.reset();
    return answer.status();
  }
  HYPERMAP_RETURN_IF_ERROR(Take(*answer));
  return answered;
}

absl::StatusOr<client::Acknowledgement> ObserveWorker::Ask() {
  stream_->Write(observation_);  // an error shows in Read
  while (std::optional<client::Acknowledgement> next = stream_->Read()) {
    if (next->sequence == observation_.sequence) return *std::move(next);
  }
  return EndOf(stream_->status());
}

absl::Status ObserveWorker::Take(const client::Acknowledgement& acknowledgement) {
  using Outcome = client::ObservationOutcome;
  // A duplicate was accepted before a connection broke.
  if (acknowledgement.outcome != Outcome::kAccepted &&
      acknowledgement.outcome != Outcome::kDuplicate) {
    return absl::FailedPreconditionError(
        absl::StrCat("observation ", client::ObservationOutcomeName(acknowledgement.outcome), ": ",
                     acknowledgement.message));
  }
  ++num_acknowledged_;
  AppendSequence(acknowledgement.sequence, &acknowledged_);
  newest_ = std::max(newest_, acknowledgement.revision);
  return absl::OkStatus();
}

absl::StatusOr<int64_t> ObserveWorker::CountLost(absl::Duration limit) {
  stream_.reset();
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto stream,
      client().Observe(load().options.map, kObjectsLayer, {.robot = robot_}, {.timeout = limit}));
  int64_t lost = 0;
  for (const client::SequenceRange& range : acknowledged_) {
    for (int64_t sequence = range.first; sequence <= range.last; ++sequence) {
      lost += !stream->opened().Knows(sequence);
    }
  }
  return lost;
}

PointsWorker::PointsWorker(const Load& load, client::Client client, int robot)
    : PacedWorker(OperationKind::kPoints, load, std::move(client), load.options.batches_hz,
                  RandomRole::kPoints, robot) {}

absl::Status PointsWorker::Open() {
  stream_ =
      client().QueryPoints(load().options.map, {}, {.timeout = LongestStream(load().options)});
  // The answer to a batch shows whether the server is there.
  absl::Status status = stream_->Ask(load().site.AskedPoints(1, random())).status();
  if (!status.ok()) stream_.reset();
  return status;
}

void PointsWorker::Prepare() {
  points_ = load().site.AskedPoints(load().options.batch_points, random());
}

absl::StatusOr<SteadyTime> PointsWorker::Attempt(const RunTimes& times) {
  if (!stream_) {
    stream_ = client().QueryPoints(load().options.map, {},
                                   {.timeout = times.give_up - SteadyTime::Now()});
  }
  const absl::Status status = stream_->Ask(points_).status();
  if (status.ok()) return SteadyTime::Now();
  stream_.reset();
  return status;
}

ClaimWorker::ClaimWorker(const Load& load, client::Client client, int robot)
    : PacedWorker(OperationKind::kClaim, load, std::move(client), load.options.claims_hz,
                  RandomRole::kClaim, robot),
      robot_(RobotName(robot)) {}

void ClaimWorker::Prepare() {
  place_ = load().site.RandomPlace(random());
  request_id_ = client::NewRequestId();
}

absl::StatusOr<SteadyTime> ClaimWorker::Attempt(const RunTimes& times) {
  const std::string& map = load().options.map;
  const absl::Duration left = times.give_up - SteadyTime::Now();
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::ClaimAnswer claim,
      client().ClaimGoal(
          map, robot_, place_, {},
          {.timeout = left, .retry_for = absl::ZeroDuration(), .request_id = request_id_}));
  const SteadyTime answered = SteadyTime::Now();
  if (!claim.goal) return answered;
  const absl::Status released =
      client()
          .ReleaseGoal(map, robot_, claim.goal->id, client::GoalOutcome::kAbandoned,
                       {.timeout = left, .retry_for = left})
          .status();
  if (!released.ok() && !absl::IsNotFound(released)) {
    recorder().Failed(SteadyTime::Now(), released);
  }
  return answered;
}

}  // namespace hypermap::bench
