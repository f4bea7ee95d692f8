#include "client_libs/cpp/replica/feed.h"

#include <utility>

#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/backoff.h"
#include "client_libs/cpp/replica/mirrored_map.h"

namespace hypermap::client {

Feed::Feed(Client client, const ReplicaOptions& options, std::optional<KnownRevision> known,
           std::function<void(const KnownRevision&)> take)
    : client_(std::move(client)),
      options_(options),
      take_(std::move(take)),
      known_(std::move(known)) {
  standing_.problem = absl::UnavailableError("no server was reached yet");
  // In terms of the server's clock, the revision was the newest at the time when it was made.
  if (known_) standing_.newest_at = known_->time;
}

Feed::~Feed() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    closing_ = true;
    if (watcher_) watcher_->Cancel();
  }
  changed_.NotifyAll();
  thread_.join();
}

void Feed::Start() {
  thread_ = std::thread([this] { Run(); });
}

Feed::Standing Feed::standing() const {
  const MutexLock lock(&mutex_);
  return standing_;
}

void Feed::AwaitFirst() const {
  const MutexLock lock(&mutex_);
  while (!tried_) changed_.Wait(&mutex_);
}

void Feed::Run() {
  Backoff backoff;
  do {
    const absl::Status why = Follow();
    if (standing().connected) backoff.Reset();
    NoteEnd(why);
    // The server no longer keeps the revision or does not have it yet, the map is another
    // incarnation or has a different revision of that number, or the events do not fit.
    starts_anew_ = absl::IsOutOfRange(why) || absl::IsAborted(why) || absl::IsInternal(why);
  } while (Sleep(backoff.Next()));
}

ReplicateOptions Feed::OptionsToGoOn() const {
  ReplicateOptions options;
  options.scope = {options_.layers, options_.frame_id};
  options.area = options_.area;
  if (known_ && !starts_anew_) {
    options.start_revision = known_->snapshot->revision;
    options.incarnation = known_->incarnation;
    options.start_time = known_->time;
  }
  return options;
}

absl::Status Feed::Follow() {
  opened_at_ = absl::Now();
  Watcher watcher = client_.Replicate(options_.map, OptionsToGoOn());
  {
    const MutexLock lock(&mutex_);
    watcher_ = &watcher;
    if (closing_) watcher.Cancel();
  }
  absl::Status status;
  bool is_first = true;
  while (status.ok()) {
    const std::optional<WatchEvent> event = watcher.Next();
    if (!event) {
      status = watcher.status();
      if (status.ok()) status = absl::UnavailableError("the server ended the call");
      break;
    }
    status = Take(*event, std::exchange(is_first, false));
  }
  const MutexLock lock(&mutex_);
  watcher_ = nullptr;
  return status;
}

absl::Status Feed::Take(const WatchEvent& event, bool is_first) {
  if (is_first) {
    if (!event.map) {
      return absl::InternalError("the server's answer: the first message has no map");
    }
    newest_at_open_ = event.map->revision;
  }
  Snapshot before;
  before.map_name = options_.map;
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr after, After(known_ ? *known_->snapshot : before, event));
  const absl::Time created_at = event.map ? event.map->create_time : known_->created_at;
  const bool had_another = known_.has_value();
  known_ = {std::move(after), event.time, created_at, event.incarnation};
  NoteEvent(event, is_first, had_another);
  take_(*known_);
  const MutexLock lock(&mutex_);
  tried_ = true;
  changed_.NotifyAll();
  return absl::OkStatus();
}

// Called before the revision is published, so that a caller who waited for the revision also sees
// this state.
void Feed::NoteEvent(const WatchEvent& event, bool is_first, bool had_another) {
  const MutexLock lock(&mutex_);
  standing_.connected = true;
  standing_.problem = absl::OkStatus();
  if (event.snapshot && had_another) ++standing_.num_taken_anew;
  if (!event.snapshot && is_first) ++standing_.num_resumed;
  // Until the revision that was the newest at the opening has arrived, events are about the past.
  const bool caught_up = event.revision >= newest_at_open_;
  if (caught_up) standing_.newest_at = is_first ? opened_at_ : absl::Now();
}

void Feed::NoteEnd(const absl::Status& why) {
  const MutexLock lock(&mutex_);
  tried_ = true;
  standing_.connected = false;
  standing_.problem = why;
  changed_.NotifyAll();
}

bool Feed::Sleep(absl::Duration pause) {
  const MutexLock lock(&mutex_);
  const Deadline deadline(pause);
  while (!closing_) {
    const absl::Duration left = deadline.left();
    if (left <= absl::ZeroDuration()) return true;
    changed_.WaitFor(&mutex_, left);
  }
  return false;
}

}  // namespace hypermap::client
