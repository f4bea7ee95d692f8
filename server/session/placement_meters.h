// Counts what a server does with maps that it shares with others.
#ifndef HYPERMAP_SERVER_SESSION_PLACEMENT_METERS_H_
#define HYPERMAP_SERVER_SESSION_PLACEMENT_METERS_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "map/snapshot.h"

namespace hypermap::server {

// Thread safe.
class PlacementMeters {
 public:
  // How far a follower is behind the store, as the last look at the store told.
  struct Lag {
    Revision revisions = 0;
    absl::Duration time;
  };

  // Notes that the store had the revision `stored` of a map when the follower showed `shown`.
  void NoteLag(const std::string& map, Revision shown, Revision stored, SteadyTime now) {
    const MutexLock lock(&mutex_);
    Followed& followed = followed_[map];
    // The follower has what it lacked; what it lacks now, it lacks since now.
    if (shown >= followed.missed) {
      followed.missed = stored;
      followed.since = now;
    }
    followed.stored = stored;
  }
  // Forgets a map that is no longer followed.
  void ForgetLag(const std::string& map) {
    const MutexLock lock(&mutex_);
    followed_.erase(map);
  }
  Lag LagOf(const std::string& map, Revision shown, SteadyTime now) const {
    const MutexLock lock(&mutex_);
    const auto found = followed_.find(map);
    if (found == followed_.end() || shown >= found->second.stored) return {};
    const Followed& followed = found->second;
    return {followed.stored - shown,
            shown < followed.missed ? now - followed.since : absl::ZeroDuration()};
  }

  // Counts a map that this server has become the owner of, other than one that it made.
  void AddTakeover() {
    const MutexLock lock(&mutex_);
    ++takeovers_;
  }
  int64_t takeovers() const {
    const MutexLock lock(&mutex_);
    return takeovers_;
  }

 private:
  struct Followed {
    Revision stored = 0;
    // A revision that the follower lacked at the time `since`, unless it has it by now.
    Revision missed = 0;
    SteadyTime since = SteadyTime::InfinitePast();
  };

  mutable Mutex mutex_;
  std::map<std::string, Followed> followed_ ABSL_GUARDED_BY(mutex_);
  int64_t takeovers_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_PLACEMENT_METERS_H_
