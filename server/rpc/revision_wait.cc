#include "server/rpc/revision_wait.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "map/layers/layer_spec.h"
#include "server/rpc/timer_queue.h"

namespace hypermap::server {
namespace {

// What is waited for.
struct Wanted {
  const Site* site;
  std::string map;
  uint64_t incarnation;  // 0: any
  Revision revision;
  bool is_linearizable;
  // What the caller has seen; 0: nothing.
  Revision seen_revision;
  uint64_t seen_incarnation;
  TimerQueue* timers;
  Deadline seen_until;  // the end of the wait for seen_revision

  // Whether the map must reach a later revision in this session because the caller has seen it.
  bool WaitsForSeen(const MapSession& session) const {
    return session.incarnation() == seen_incarnation && seen_revision > revision;
  }
  Revision RevisionIn(const MapSession& session) const {
    return WaitsForSeen(session) ? seen_revision : revision;
  }
};

absl::StatusOr<std::shared_ptr<MapSession>> FindSession(const Wanted& wanted) {
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<MapSession> session, wanted.site->Find(wanted.map));
  HYPERMAP_RETURN_IF_ERROR(session->CheckIncarnation(wanted.incarnation));
  return session;
}

}  // namespace

// Shared with the callbacks of feeds, timers and the read index, which may come after the
// RevisionWait is gone.
class RevisionWait::State : public std::enable_shared_from_this<State> {
 public:
  // Returns false if the wait was stopped before.
  bool Begin(Done* done) {
    MutexLock lock(&mutex_);
    if (is_stopped_) return false;
    done_ = std::move(*done);
    return true;
  }

  void Stop() {
    {
      MutexLock lock(&mutex_);
      is_stopped_ = true;
    }
    End(absl::CancelledError("the wait for a revision was stopped"));
  }

  void AskNewest(Wanted wanted) {
    const Site* const site = wanted.site;
    const std::string map = wanted.map;
    site->AskNewest(map, [self = shared_from_this(), wanted = std::move(wanted)](
                             const absl::StatusOr<storage::NewestRevision>& newest) mutable {
      if (!newest.ok()) return self->End(newest.status());
      wanted.incarnation = newest->incarnation;
      wanted.revision = std::max(wanted.revision, newest->revision);
      self->Await(std::move(wanted));
    });
  }

  // Waits for the session of the map that there is now.
  void Await(Wanted wanted) {
    const absl::StatusOr<std::shared_ptr<MapSession>> session = FindSession(wanted);
    if (!session.ok()) return End(WithoutSession(wanted, session.status()));
    AwaitIn(*session, std::move(wanted));
  }

  void End(const absl::StatusOr<Revision>& reached) {
    Done done;
    Place place;
    {
      MutexLock lock(&mutex_);
      done = std::exchange(done_, nullptr);
      place = TakePlace();
    }
    place.Leave();
    if (done) std::move(done)(reached);
  }

 private:
  // The entries of the wait in a feed and among the timers.
  struct Place {
    std::shared_ptr<MapSession> session;
    ChangeFeed::WaitId id = 0;
    TimerQueue* timers = nullptr;  // null if the wait has no end of its own
    TimerQueue::Id timer = 0;

    void Leave() const {
      if (session) session->feed().Remove(id);
      if (timers != nullptr) timers->Cancel(timer);
    }
  };

  static absl::StatusOr<Revision> WithoutSession(const Wanted& wanted, const absl::Status& status) {
    const bool is_outdated = absl::IsNotFound(status) || absl::IsAborted(status);
    if (!wanted.is_linearizable || !is_outdated) return wanted.revision;
    return absl::UnavailableError(absl::StrCat("this server does not have the map \"", wanted.map,
                                               "\" as it is now: ", status.message()));
  }

  void AwaitIn(const std::shared_ptr<MapSession>& session, Wanted wanted) {
    const Revision revision = wanted.RevisionIn(*session);
    if (session->snapshot()->revision >= revision) return End(revision);
    // Another server may have told nothing of it yet.
    if (session->is_follower()) session->LookForRevisions();
    const int64_t turn = NextTurn();
    Place place{.session = session};
    if (wanted.WaitsForSeen(*session)) {
      place.timers = wanted.timers;
      const auto end = [self = shared_from_this(), turn, session, revision] {
        self->EndWithout(revision, *session, turn);
      };
      place.timer = place.timers->RunAfter(wanted.seen_until.left(), end);
    }
    place.id = session->feed().Await(revision - 1, [self = shared_from_this(), turn, session,
                                                    wanted = std::move(wanted)]() mutable {
      if (self->TakeTurn(turn)) self->Woken(session, std::move(wanted));
    });
    if (!SetPlace(place, turn)) place.Leave();
  }

  // Called when `session` has the revision, or its feed was closed.
  void Woken(const std::shared_ptr<MapSession>& session, Wanted wanted) {
    const Revision revision = wanted.RevisionIn(*session);
    if (session->snapshot()->revision < revision) {
      const absl::StatusOr<std::shared_ptr<MapSession>> next = FindSession(wanted);
      if (!next.ok()) return End(WithoutSession(wanted, next.status()));
      if (*next != session) return AwaitIn(*next, std::move(wanted));
    }
    End(revision);
  }

  // Called when the time is over for the revision that the caller has seen.
  void EndWithout(Revision seen, const MapSession& session, int64_t turn) {
    if (!TakeTurn(turn)) return;
    End(absl::UnavailableError(absl::StrCat("this server has the map at revision ",
                                            session.snapshot()->revision, ", the caller has seen ",
                                            seen)));
  }

  int64_t NextTurn() {
    MutexLock lock(&mutex_);
    return ++turn_;
  }

  // Leaves the place of a turn. Returns false if the turn is over: the feed and the timer may call
  // at the same time, and then only the first goes on.
  bool TakeTurn(int64_t turn) {
    Place place;
    {
      MutexLock lock(&mutex_);
      if (turn_ != turn) return false;
      place = TakePlace();
    }
    place.Leave();
    return true;
  }

  Place TakePlace() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    ++turn_;
    return std::exchange(place_, {});
  }

  // Notes the entries of a turn. Returns false if the turn is over; then the caller must remove
  // them.
  bool SetPlace(const Place& place, int64_t turn) {
    MutexLock lock(&mutex_);
    if (turn_ != turn || is_stopped_) return false;
    place_ = place;
    return true;
  }

  Mutex mutex_;
  bool is_stopped_ ABSL_GUARDED_BY(mutex_) = false;
  Done done_ ABSL_GUARDED_BY(mutex_);
  Place place_ ABSL_GUARDED_BY(mutex_);
  // Another one for each place, and after its end.
  int64_t turn_ ABSL_GUARDED_BY(mutex_) = 0;
};

RevisionWait::RevisionWait() : state_(std::make_shared<State>()) {}

void RevisionWait::Start(const Facilities& facilities, const v1::Scope& scope,
                         const v1::AsOf& as_of, Done done) {
  if (!state_->Begin(&done)) return std::move(done)(absl::CancelledError("the call has ended"));
  const std::shared_ptr<State> state = state_;  // `done` may delete this
  Wanted wanted{facilities.site,
                scope.map(),
                scope.incarnation(),
                as_of.min_revision(),
                as_of.consistency() == v1::CONSISTENCY_LINEARIZABLE,
                as_of.seen_revision(),
                as_of.seen_incarnation(),
                facilities.timers,
                Deadline(kSeen)};
  // The answer tells what is wrong.
  if (wanted.revision < 0 || wanted.seen_revision < 0 || !ValidateName("map", scope.map()).ok()) {
    return state->End(wanted.revision);
  }
  if (wanted.is_linearizable) return state->AskNewest(std::move(wanted));
  if (wanted.revision == 0 && wanted.seen_revision == 0) return state->End(wanted.revision);
  state->Await(std::move(wanted));
}

void RevisionWait::Stop() { state_->Stop(); }

}  // namespace hypermap::server
