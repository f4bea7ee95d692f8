#include "server/rpc/revision_wait.h"

#include <utility>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// Shared with the feed's callback, which may come after the RevisionWait is gone.
class RevisionWait::State {
 public:
  // The entry of the wait in a feed.
  struct Place {
    std::shared_ptr<MapSession> session;
    ChangeFeed::WaitId id = 0;

    void Leave() const {
      if (session) session->feed().Remove(id);
    }
  };

  // Returns false if the wait was stopped before.
  bool Begin(absl::AnyInvocable<void() &&>* done) {
    MutexLock lock(&mutex_);
    if (ended_) return false;
    done_ = std::move(*done);
    return true;
  }

  // Notes the entry in the feed. Returns false if the wait has ended already; then the caller must
  // remove the entry.
  bool SetPlace(Place place) {
    MutexLock lock(&mutex_);
    if (ended_) return false;
    place_ = std::move(place);
    return true;
  }

  void End() {
    absl::AnyInvocable<void() &&> done;
    Place place;
    {
      MutexLock lock(&mutex_);
      ended_ = true;
      done = std::exchange(done_, nullptr);
      place = std::exchange(place_, {});
    }
    place.Leave();
    if (done) std::move(done)();
  }

 private:
  Mutex mutex_;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  absl::AnyInvocable<void() &&> done_ ABSL_GUARDED_BY(mutex_);
  Place place_ ABSL_GUARDED_BY(mutex_);
};

RevisionWait::RevisionWait() : state_(std::make_shared<State>()) {}

void RevisionWait::Start(const Facilities& facilities, const v1::Scope& scope, Revision revision,
                         absl::AnyInvocable<void() &&> done) {
  if (!state_->Begin(&done)) return std::move(done)();
  absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(facilities, scope);
  if (revision <= 0 || !session.ok() || (*session)->snapshot()->revision >= revision) {
    return state_->End();
  }
  const std::shared_ptr<State> state = state_;  // `done` may delete this
  const ChangeFeed::WaitId id = (*session)->feed().Await(revision - 1, [state] { state->End(); });
  const State::Place place{*std::move(session), id};
  if (!state->SetPlace(place)) place.Leave();
}

void RevisionWait::Stop() { state_->End(); }

}  // namespace hypermap::server
