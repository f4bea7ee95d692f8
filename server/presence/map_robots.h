// Where the robots of a map are: the newest report of each.
#ifndef HYPERMAP_SERVER_PRESENCE_MAP_ROBOTS_H_
#define HYPERMAP_SERVER_PRESENCE_MAP_ROBOTS_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/limits/limits.h"
#include "base/sync/mutex.h"
#include "base/time/server_clock.h"
#include "map/robots/robot_presence.h"

namespace hypermap::server {

// Keeps the robots of one map in memory, each with a number that grows with every change of any of
// them. A reader holds the number of the last change that it knows, and reads the robots that have
// changed since: however slow it is, it gets the newest state of each robot once, and costs no
// memory. What passes with time (robots that go offline or are forgotten) is brought up to date by
// every call, so that readers must look again after UntilChange(). Costs are logarithmic in the
// number of robots. Thread safe; no lock is held while a callback runs.
class MapRobots {
 public:
  // Robots of the limits max_robots, robot_online_seconds and robot_memory_seconds. `clock` must
  // outlive this.
  MapRobots(const Limits& limits, ServerClock* clock);

  // Takes a report that comes now. Returns whether it is the newest one of its robot: false, and
  // nothing is changed, if the robot is online and its newest report has a later stamp.
  // RESOURCE_EXHAUSTED if there are max_robots others, all online.
  absl::StatusOr<bool> Report(RobotReport report);

  // All robots, sorted by name, in the frames of their reports.
  std::vector<RobotPresence> List();

  // The number of a change. Changes have numbers above 1, so that a reader who knows that there are
  // no robots yet has a number, too.
  using ChangeNumber = int64_t;
  struct Changes {
    // The last change that the reader knows when it has these.
    ChangeNumber number = 0;
    // Whether these and those that follow are all robots.
    bool reset = false;
    // Whether there are more changes.
    bool more = false;
    std::vector<RobotPresence> robots;
    std::vector<std::string> forgotten;
  };
  // Reads what has changed after `after`, in the order of the changes: at most `max_items` robots,
  // and no more once they take `max_bytes`. Begins with all robots if `after` is 0, or so old that
  // it is not known any more which robots were forgotten since. Also names forgotten robots that
  // such a reader does not know.
  Changes ReadAfter(ChangeNumber after, int64_t max_items, int64_t max_bytes);
  // Time until a robot goes offline or is forgotten, if none reports before; infinite without
  // robots.
  absl::Duration UntilChange();

  using Callback = absl::AnyInvocable<void() &&>;
  using WaitId = int64_t;
  // Calls `callback` once, as soon as there is a change after `after`: at once, or later on the
  // thread that notices the change.
  WaitId Await(ChangeNumber after, Callback callback);
  // Drops a callback that was not called yet. A call may already be under way on another thread.
  void Remove(WaitId id);

  struct Count {
    size_t online = 0;
    size_t offline = 0;
  };
  Count count();

 private:
  struct Robot {
    RobotPresence presence;
    absl::Duration seen;  // ServerClock::SinceBoot() when the newest report came
    ChangeNumber changed = 0;
  };
  // Robots in the order in which they were seen.
  using SeenOrder = std::set<std::pair<absl::Duration, std::string>>;

  class Turn;

  // Lets robots go offline, and forgets them, as the time has come.
  void PassTime(absl::Duration now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Accept(RobotReport report, const ServerClock::Instant& now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Makes room for another robot. RESOURCE_EXHAUSTED.
  absl::Status MakeRoom() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Notes a change of a robot whose last one was `*changed`; 0: none.
  void NoteChange(const std::string& name, ChangeNumber* changed)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // REQUIRES: the robot is offline.
  void Forget(const std::string& name) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Adds the change to `changes`; returns the bytes that it takes there.
  int64_t Tell(const std::string& name, Changes* changes) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const size_t max_robots_;
  const absl::Duration online_for_;
  const absl::Duration remembered_for_;
  ServerClock* const clock_;

  Mutex mutex_;
  std::map<std::string, Robot> robots_ ABSL_GUARDED_BY(mutex_);
  SeenOrder online_ ABSL_GUARDED_BY(mutex_);
  SeenOrder offline_ ABSL_GUARDED_BY(mutex_);
  // The last change of each robot, also of those that were forgotten last, at most max_robots_.
  std::map<ChangeNumber, std::string> changes_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, ChangeNumber> forgotten_ ABSL_GUARDED_BY(mutex_);
  ChangeNumber newest_ ABSL_GUARDED_BY(mutex_) = 1;
  // The last change by which a robot was forgotten that is not known any more; 0: none.
  ChangeNumber lost_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<WaitId, Callback> waiters_ ABSL_GUARDED_BY(mutex_);
  WaitId next_wait_ ABSL_GUARDED_BY(mutex_) = 1;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_PRESENCE_MAP_ROBOTS_H_
