#include "client_libs/bench/robot_workers.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/backoff.h"

namespace hypermap::bench {
namespace {

// The first arguments of RandomOf; those of other workers are in their files.
constexpr uint64_t kObserveRole = 1;
constexpr uint64_t kPointsRole = 2;
constexpr uint64_t kClaimRole = 3;

// Waits before a stream is opened again, until there is a server. Returns false if there is no time
// for it. The client retries calls but not streams, and while no call is under way, its connection
// is made anew only after seconds.
bool AwaitServer(client::Client& client, const std::string& map, client::Backoff& backoff,
                 const RunTimes& times) {
  const absl::Duration pause = backoff.Next();
  if (SteadyTime::Now() + pause >= times.give_up) return false;
  absl::SleepFor(pause);
  client::CallOptions options;
  options.timeout = options.retry_for = times.give_up - SteadyTime::Now();
  client.GetMap(map, options).status().IgnoreError();  // the stream shows the error
  return SteadyTime::Now() < times.give_up;
}

// Reason why a stream ended that was expected to go on.
absl::Status EndOf(const absl::Status& status) {
  return status.ok() ? absl::UnavailableError("the server ended the stream") : status;
}

}  // namespace

PacedWorker::PacedWorker(OperationKind kind, const Load& load, double hz, uint64_t role,
                         uint64_t number)
    : Worker(kind), load_(load), hz_(hz), random_(RandomOf(load.options.seed, role, number)) {}

void PacedWorker::Run(const RunTimes& times) {
  const Schedule schedule(times.start, hz_, RandomPhase(random_));
  for (int64_t k = 0; schedule.At(k) < times.end; ++k) {
    const SteadyTime due = schedule.At(k);
    SleepUntil(due);
    recorder().Due(due);
    const SteadyTime now = SteadyTime::Now();
    if (now - due > schedule.period()) recorder().Late(due);
    if (now >= times.give_up) continue;  // counts as not answered
    if (const auto answered = Do(times)) recorder().Answered(due, *answered);
  }
}

void PacedWorker::NoteFailure(const absl::Status& why) {
  recorder().Failed(SteadyTime::Now(), why);
}

std::string RobotName(int number) { return absl::StrCat("bench-robot-", number); }

ObserveWorker::ObserveWorker(const Load& load, client::Client client, int robot, int outage_client)
    : PacedWorker(OperationKind::kObservation, load, load.options.observe_hz, kObserveRole, robot),
      client_(std::move(client)),
      robot_(RobotName(robot)),
      outage_client_(outage_client) {}

absl::Status ObserveWorker::Open() { return OpenStream(LongestStream(load().options)); }

absl::Status ObserveWorker::OpenStream(absl::Duration limit) {
  HYPERMAP_ASSIGN_OR_RETURN(stream_, client_.Observe(load().options.map, kObjectsLayer,
                                                     {.robot = robot_}, {.timeout = limit}));
  // A run before this one may have used the robot's name.
  const std::vector<client::SequenceRange>& known = stream_->opened().known;
  if (!known.empty()) next_sequence_ = std::max(next_sequence_, known.back().last + 1);
  return absl::OkStatus();
}

absl::StatusOr<client::Acknowledgement> ObserveWorker::Ask(const Observation& observation) {
  stream_->Write(observation);  // an error shows in Read
  while (std::optional<client::Acknowledgement> next = stream_->Read()) {
    if (next->sequence == observation.sequence) return *std::move(next);
  }
  return EndOf(stream_->status());
}

bool ObserveWorker::Take(const client::Acknowledgement& acknowledgement) {
  using Outcome = client::ObservationOutcome;
  // A duplicate was accepted before a connection broke.
  if (acknowledgement.outcome != Outcome::kAccepted &&
      acknowledgement.outcome != Outcome::kDuplicate) {
    NoteFailure(absl::FailedPreconditionError(
        absl::StrCat("observation ", client::ObservationOutcomeName(acknowledgement.outcome), ": ",
                     acknowledgement.message)));
    return false;
  }
  ++num_acknowledged_;
  AppendSequence(acknowledgement.sequence, &acknowledged_);
  newest_ = std::max(newest_, acknowledgement.revision);
  return true;
}

std::optional<SteadyTime> ObserveWorker::Do(const RunTimes& times) {
  const int64_t sequence = next_sequence_++;
  const Observation observation = load().site.Observe(robot_, sequence, absl::Now(), random());
  client::Backoff backoff;
  do {
    absl::Status status =
        stream_ ? absl::OkStatus() : OpenStream(times.give_up - SteadyTime::Now());
    if (status.ok()) {
      const absl::StatusOr<client::Acknowledgement> answer = Ask(observation);
      if (answer.ok()) {
        const SteadyTime now = SteadyTime::Now();
        load().outages.Answered(outage_client_, now);
        if (!Take(*answer)) return std::nullopt;
        return now;
      }
      status = answer.status();
    }
    stream_.reset();
    NoteFailure(status);
    load().outages.Failed(outage_client_, SteadyTime::Now());
  } while (AwaitServer(client_, load().options.map, backoff, times));
  return std::nullopt;
}

absl::StatusOr<int64_t> ObserveWorker::CountLost(absl::Duration limit) {
  stream_.reset();
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto stream,
      client_.Observe(load().options.map, kObjectsLayer, {.robot = robot_}, {.timeout = limit}));
  int64_t lost = 0;
  for (const client::SequenceRange& range : acknowledged_) {
    for (int64_t sequence = range.first; sequence <= range.last; ++sequence) {
      lost += !stream->opened().Knows(sequence);
    }
  }
  return lost;
}

PointsWorker::PointsWorker(const Load& load, client::Client client, int robot, int outage_client)
    : PacedWorker(OperationKind::kPoints, load, load.options.batches_hz, kPointsRole, robot),
      client_(std::move(client)),
      outage_client_(outage_client) {}

absl::Status PointsWorker::Open() {
  stream_ = client_.QueryPoints(load().options.map, {}, {.timeout = LongestStream(load().options)});
  // The answer to a batch shows whether the server is there.
  absl::Status status = stream_->Ask(load().site.AskedPoints(1, random())).status();
  if (!status.ok()) stream_.reset();
  return status;
}

std::optional<SteadyTime> PointsWorker::Do(const RunTimes& times) {
  const std::vector<Point> points = load().site.AskedPoints(load().options.batch_points, random());
  client::Backoff backoff;
  do {
    if (!stream_) {
      stream_ = client_.QueryPoints(load().options.map, {},
                                    {.timeout = times.give_up - SteadyTime::Now()});
    }
    const absl::Status status = stream_->Ask(points).status();
    if (status.ok()) {
      const SteadyTime now = SteadyTime::Now();
      load().outages.Answered(outage_client_, now);
      return now;
    }
    stream_.reset();
    NoteFailure(status);
    load().outages.Failed(outage_client_, SteadyTime::Now());
  } while (AwaitServer(client_, load().options.map, backoff, times));
  return std::nullopt;
}

ClaimWorker::ClaimWorker(const Load& load, client::Client client, int robot)
    : PacedWorker(OperationKind::kClaim, load, load.options.claims_hz, kClaimRole, robot),
      client_(std::move(client)),
      robot_(RobotName(robot)) {}

std::optional<SteadyTime> ClaimWorker::Do(const RunTimes& times) {
  const std::string& map = load().options.map;
  client::CallOptions options;
  options.timeout = options.retry_for = times.give_up - SteadyTime::Now();
  const absl::StatusOr<client::ClaimAnswer> claim =
      client_.ClaimGoal(map, robot_, load().site.RandomPlace(random()), {}, options);
  if (!claim.ok()) {
    NoteFailure(claim.status());
    return std::nullopt;
  }
  const SteadyTime answered = SteadyTime::Now();
  if (!claim->goal) return answered;
  const absl::Status released =
      client_.ReleaseGoal(map, robot_, claim->goal->id, client::GoalOutcome::kAbandoned, options)
          .status();
  if (!released.ok() && !absl::IsNotFound(released)) NoteFailure(released);
  return answered;
}

}  // namespace hypermap::bench
