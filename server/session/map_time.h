// The time of one map: when its commits are made, and how long ago that is.
#ifndef HYPERMAP_SERVER_SESSION_MAP_TIME_H_
#define HYPERMAP_SERVER_SESSION_MAP_TIME_H_

#include <memory>
#include <optional>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/time/server_clock.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Keeps three clocks of a map (docs/decisions/021-time-that-passed.md).
//
// *Commit times* order the history. They are the server's clock, except that they never go back:
// after the clock was followed far ahead and back again, they stand still but for a microsecond for
// each commit, until the clock has come by.
//
// *Passed* is the time that certainly passed for the map. The ages of receipts and of history are
// measured by it, so that nothing is let go early. It goes on while the server is down, as long as
// the machine is up.
//
// *Lived* also counts the time for which the machine was off, which only the wall clock knows. The
// ends of objects are measured by it. A time of at most kTrustedOff is counted at once; a longer or
// negative one when the wall clock has been in step for ServerClock::kSettle.
//
// Marks (storage::TimeMark) tie commit times to the other two, across restarts. Does no I/O itself.
// Thread safe; methods that say so are for the map's writer.
class MapTime {
 public:
  static constexpr absl::Duration kTrustedOff = absl::Hours(1);
  // Longest time between two marks of a map that is open.
  static constexpr absl::Duration kMarkInterval = absl::Hours(1);

  // Continues the time of a map with these stored marks, whose newest commit was made at
  // `newest_commit`. Makes the server's clock go on from the newest mark if it is of this boot.
  MapTime(std::shared_ptr<ServerClock> clock, std::vector<storage::TimeMark> marks,
          absl::Time newest_commit);

  // The server's time, but not before the newest commit.
  absl::Time Now() const;
  absl::Duration Passed() const;
  absl::Duration Lived() const;

  // The value of Lived() at which the object expires; infinite if it does not.
  absl::Duration EndOf(const SemanticObject& object) const;
  bool IsOver(const SemanticObject& object) const { return EndOf(object) <= Lived(); }

  // The latest time such that commits of then and before are at least so old.
  absl::Time CommitTimeBefore(absl::Duration age) const;

  // Writer: the time of the next commit.
  absl::Time NextCommit();

  // Writer: a mark of this moment, which the caller must store before it makes the next commit;
  // nullopt if the newest mark still holds for it. `newest` is the map's newest revision.
  std::optional<storage::TimeMark> MarkBeforeCommit(Revision newest);
  // Writer: a mark for the next start of the server. nullopt if there is a young one, unless the
  // map is closing.
  std::optional<storage::TimeMark> MarkForRestart(Revision newest, bool closing);
  // Writer: the newest mark could not be stored. The next commit needs another one.
  void MarkIsLost();
  // Writer: the newest mark was stored, and all but the newest of those with passed <
  // `forget_before` were forgotten.
  void MarkIsStored(absl::Duration forget_before);

  // Writer: notices jumps of the wall clock, which needs a reading now and then, and counts the
  // time for which the machine was off as soon as it is known.
  void ReadClocks();

 private:
  // The clock was right when the machine went off, or the map was closed, at `since`.
  struct TimeOff {
    absl::Time since;
    absl::Duration passed;  // Passed() then
  };

  void ResumeAfterBoot(const storage::TimeMark* last, absl::Time newest_commit)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Duration PassedAt(absl::Duration since_boot) const { return passed_at_boot_ + since_boot; }
  absl::Duration LivedAt(absl::Duration since_boot) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return PassedAt(since_boot) + off_;
  }
  storage::TimeMark MakeMark(Revision newest, absl::Time commit_time,
                             const ServerClock::Instant& at) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  storage::TimeMark Add(storage::TimeMark mark) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::shared_ptr<ServerClock> clock_;
  absl::Duration passed_at_boot_;  // Passed() - SinceBoot()

  mutable Mutex mutex_;
  absl::Duration off_ ABSL_GUARDED_BY(mutex_);  // Lived() - Passed()
  std::optional<TimeOff> unknown_off_ ABSL_GUARDED_BY(mutex_);
  absl::Time last_commit_ ABSL_GUARDED_BY(mutex_);
  std::vector<storage::TimeMark> marks_ ABSL_GUARDED_BY(mutex_);
  bool mark_is_lost_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_MAP_TIME_H_
