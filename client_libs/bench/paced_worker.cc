#include "client_libs/bench/paced_worker.h"

#include <cstdint>
#include <utility>

#include "absl/time/clock.h"

namespace hypermap::bench {
namespace {

// Returns whether the same operation may succeed later. A killed server shows in several codes, so
// that only those that blame the request are final.
bool MayPass(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kUnimplemented:
      return false;
    default:
      return true;
  }
}

}  // namespace

PacedWorker::PacedWorker(OperationKind kind, const Load& load, client::Client client, double hz,
                         RandomRole role, int number)
    : Worker(kind),
      load_(load),
      client_(std::move(client)),
      hz_(hz),
      outage_client_(load.outages.AddClient()),
      random_(RandomOf(load.options.seed, role, number)) {}

void PacedWorker::Run(const RunTimes& times) {
  const Schedule schedule(times.start, hz_, RandomPhase(random_));
  for (int64_t k = 0; schedule.At(k) < times.end; ++k) {
    const SteadyTime due = schedule.At(k);
    SleepUntil(due);
    recorder().Due(due);
    const SteadyTime now = SteadyTime::Now();
    if (now - due > schedule.period()) recorder().Late(due);
    if (now >= times.give_up) continue;  // counts as not answered
    if (const auto answered = CarryOut(times)) recorder().Answered(due, *answered);
  }
}

std::optional<SteadyTime> PacedWorker::CarryOut(const RunTimes& times) {
  Prepare();
  client::Backoff backoff;
  while (true) {
    const absl::StatusOr<SteadyTime> answered = Attempt(times);
    if (answered.ok()) {
      load_.outages.Answered(outage_client_, *answered);
      return *answered;
    }
    const SteadyTime failed = SteadyTime::Now();
    recorder().Failed(failed, answered.status());
    if (!MayPass(answered.status())) break;
    load_.outages.Failed(outage_client_, failed);
    if (!AwaitServer(backoff, times)) break;
    recorder().Retried(SteadyTime::Now());
  }
  GiveUp();
  return std::nullopt;
}

bool PacedWorker::AwaitServer(client::Backoff& backoff, const RunTimes& times) {
  const absl::Duration pause = backoff.Next();
  if (SteadyTime::Now() + pause >= times.give_up) return false;
  absl::SleepFor(pause);
  // While no call is under way, gRPC connects again only after seconds. The client library retries
  // this call as soon as there is a connection.
  client::CallOptions options;
  options.timeout = options.retry_for = times.give_up - SteadyTime::Now();
  client_.GetMap(load_.options.map, options).status().IgnoreError();  // the next attempt shows it
  return SteadyTime::Now() < times.give_up;
}

}  // namespace hypermap::bench
