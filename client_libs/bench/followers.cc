#include "client_libs/bench/followers.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/backoff.h"

namespace hypermap::bench {
namespace {

// How soon a replica's thread notices that it has to stop.
constexpr absl::Duration kLook = absl::Milliseconds(200);

// Returns whether the client library has ended a watch because of its messages. It refuses
// revisions that come again or go back.
bool IsRefusal(const absl::Status& why) {
  return absl::IsInternal(why) && absl::StartsWith(why.message(), "the server's answer");
}

}  // namespace

WatchWorker::WatchWorker(OperationKind kind, const Following& following, client::Client client)
    : Worker(kind),
      following_(following),
      client_(std::move(client)),
      outage_client_(following.outages.AddClient()),
      track_(following.start) {}

client::Watcher WatchWorker::Call() {
  if (recorder().kind() == OperationKind::kReplicaDelivery) {
    client::ReplicateOptions options;
    options.start_revision = track_.last();
    options.incarnation = following_.incarnation;
    options.with_changes = false;
    return client_.Replicate(following_.map, options);
  }
  client::WatchOptions options;
  options.start_revision = track_.last();
  options.incarnation = following_.incarnation;
  options.with_changes = false;
  return client_.Watch(following_.map, options);
}

absl::Status WatchWorker::Open() {
  auto watcher = std::make_unique<client::Watcher>(Call());
  num_resumed_ = 0;
  const MutexLock lock(&mutex_);
  watcher_ = std::move(watcher);
  if (stopped_) watcher_->Cancel();
  return absl::OkStatus();
}

void WatchWorker::Stop() {
  const MutexLock lock(&mutex_);
  stopped_ = true;
  if (watcher_) watcher_->Cancel();
  stop_.NotifyAll();
}

bool WatchWorker::is_stopped() const {
  const MutexLock lock(&mutex_);
  return stopped_;
}

void WatchWorker::Run(const RunTimes& /*times*/) {
  client::Watcher* watcher = nullptr;
  client::Backoff backoff;
  while (!is_stopped()) {
    {
      const MutexLock lock(&mutex_);
      watcher = watcher_.get();
    }
    while (const std::optional<client::WatchEvent> event = watcher->Next()) {
      backoff.Reset();
      Take(*event, watcher->num_resumed());
    }
    if (is_stopped()) break;
    NoteEnd(watcher->status(), backoff.Next());
    Open().IgnoreError();  // an error shows in the next event
    recorder().Retried(SteadyTime::Now());
  }
}

void WatchWorker::Take(const client::WatchEvent& event, int num_resumed) {
  const SteadyTime now = SteadyTime::Now();
  const absl::Duration lag = absl::Now() - event.time;
  if (num_resumed != num_resumed_) {
    num_resumed_ = num_resumed;
    recorder().Failed(now, absl::UnavailableError("the watch broke, and has resumed"));
    recorder().Retried(now);
    following_.outages.Failed(outage_client_, now);
  }
  following_.outages.Answered(outage_client_, now);
  const bool has_changes = event.num_changes > 0;
  track_.Note(event.revision, has_changes);
  following_.times.Note(event.revision,
                        has_changes ? std::optional<absl::Time>(event.time) : std::nullopt);
  if (!has_changes) return;
  recorder().Due(now - lag);
  recorder().Answered(now - lag, now);
}

void WatchWorker::NoteEnd(const absl::Status& why, absl::Duration pause) {
  const SteadyTime now = SteadyTime::Now();
  if (IsRefusal(why)) track_.NoteRefusal();
  recorder().Failed(now, why.ok() ? absl::UnavailableError("the server ended the watch") : why);
  following_.outages.Failed(outage_client_, now);
  const Deadline deadline(pause);
  const MutexLock lock(&mutex_);
  while (!stopped_ && !deadline.has_passed()) stop_.WaitFor(&mutex_, deadline.left());
}

ReplicaWorker::ReplicaWorker(const Following& following, client::Client client, std::string folder)
    : Worker(OperationKind::kReplicaLag),
      following_(following),
      client_(std::move(client)),
      folder_(std::move(folder)),
      outage_client_(following.outages.AddClient()) {}

absl::Status ReplicaWorker::Open() {
  HYPERMAP_ASSIGN_OR_RETURN(
      replica_, client::Replica::Open(client_, {.map = following_.map, .folder = folder_}));
  revision_ = replica_->snapshot()->revision;
  return absl::OkStatus();
}

void ReplicaWorker::Run(const RunTimes& /*times*/) {
  while (!stopped_) {
    if (replica_->AwaitRevision(revision_ + 1, kLook).ok()) {
      NoteArrivals(replica_->snapshot()->revision);
      NoteBreaks();
    }
    RecordArrivals();
  }
  RecordArrivals();
}

void ReplicaWorker::NoteArrivals(Revision revision) {
  const absl::Time time = absl::Now();
  const SteadyTime moment = SteadyTime::Now();
  for (Revision r = revision_ + 1; r <= revision; ++r) {
    arrivals_.push_back({r, time, moment});
  }
  revision_ = revision;
}

void ReplicaWorker::RecordArrivals() {
  while (!arrivals_.empty() && following_.times.IsSettled(arrivals_.front().revision)) {
    const Arrival arrival = arrivals_.front();
    arrivals_.pop_front();
    const std::optional<absl::Time> made = following_.times.TimeOf(arrival.revision);
    if (!made) continue;  // nothing has changed
    const SteadyTime due = arrival.moment - (arrival.time - *made);
    recorder().Due(due);
    recorder().Answered(due, arrival.moment);
  }
}

void ReplicaWorker::NoteBreaks() {
  const SteadyTime now = SteadyTime::Now();
  const client::ReplicaState state = replica_->state();
  if (const int breaks = state.num_resumed + state.num_taken_anew; breaks != num_breaks_) {
    num_breaks_ = breaks;
    recorder().Failed(now, absl::UnavailableError("the replica's connection broke"));
    recorder().Retried(now);
    following_.outages.Failed(outage_client_, now);
  }
  following_.outages.Answered(outage_client_, now);
}

}  // namespace hypermap::bench
