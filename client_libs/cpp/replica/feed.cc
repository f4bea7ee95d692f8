#include "client_libs/cpp/replica/feed.h"

#include <utility>

#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/backoff.h"

namespace hypermap::client {

Feed::Feed(Client client, const ReplicaOptions& options, std::optional<KnownRevision> known,
           std::function<void(const KnownRevision&)> take)
    : client_(std::move(client)),
      options_(options),
      take_(std::move(take)),
      cursor_(options, std::move(known)) {
  standing_.problem = absl::UnavailableError("no server was reached yet");
  // In terms of the server's clock, the revision was the newest at the time when it was made.
  if (cursor_.known()) standing_.newest_at = cursor_.known()->time;
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

void Feed::TakeAnew() {
  const MutexLock lock(&mutex_);
  must_take_anew_ = true;
  if (watcher_) watcher_->Cancel();
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
    cursor_.EndCall(why);
  } while (Sleep(backoff.Next()));
}

absl::Status Feed::Follow() {
  opened_at_ = absl::Now();
  const bool takes_anew = MustTakeAnew();
  if (takes_anew) cursor_.StartAnew();
  Watcher watcher = client_.Replicate(options_.map, cursor_.BeginCall());
  {
    const MutexLock lock(&mutex_);
    watcher_ = &watcher;
    if (closing_ || must_take_anew_ != takes_anew) watcher.Cancel();
  }
  absl::Status status;
  while (status.ok()) {
    const std::optional<WatchEvent> event = watcher.Next();
    if (!event) {
      status = watcher.status();
      if (status.ok()) status = absl::UnavailableError("the server ended the call");
      break;
    }
    status = Take(*event);
  }
  const MutexLock lock(&mutex_);
  watcher_ = nullptr;
  return status;
}

bool Feed::MustTakeAnew() const {
  const MutexLock lock(&mutex_);
  return must_take_anew_;
}

absl::Status Feed::Take(const WatchEvent& event) {
  HYPERMAP_ASSIGN_OR_RETURN(const FeedCursor::Step step, cursor_.Take(event));
  NoteEvent(step);
  take_(*cursor_.known());
  const MutexLock lock(&mutex_);
  tried_ = true;
  changed_.NotifyAll();
  return absl::OkStatus();
}

// Called before the revision is published, so that a caller who waited for the revision also sees
// this state.
void Feed::NoteEvent(const FeedCursor::Step& step) {
  const MutexLock lock(&mutex_);
  standing_.connected = true;
  standing_.problem = absl::OkStatus();
  if (step.taken_anew) {
    ++standing_.num_taken_anew;
    must_take_anew_ = false;
  }
  if (step.resumed) ++standing_.num_resumed;
  if (step.caught_up) standing_.newest_at = step.is_first ? opened_at_ : absl::Now();
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
