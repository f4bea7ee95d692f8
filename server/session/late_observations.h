// Late observations, which wait until the fold of all that is newer has been made with them.
#ifndef HYPERMAP_SERVER_SESSION_LATE_OBSERVATIONS_H_
#define HYPERMAP_SERVER_SESSION_LATE_OBSERVATIONS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "base/sync/steady_time.h"
#include "map/snapshot.h"
#include "server/fusion/map_fusion.h"
#include "server/session/group_commit.h"

namespace hypermap::server {

// An observation that is a minute late makes all observations of a minute be folded again, by the
// thread that writes everything. So it waits here, while this thread folds in advance, a little
// between any two groups; then it costs its commit as little as others do.
//
// There are two works at a time, of observations that are little late and of those that are very
// late, so that a robot that comes back after minutes does not hold up those that come back after
// seconds. The observations of one robot keep their order: those that come after a late one wait
// with it. Used by the writer's thread only.
class LateObservations {
 public:
  // `executor` is the writer's. Both must outlive this.
  LateObservations(MapFusion* fusion, const Executor* executor)
      : fusion_(fusion), executor_(executor) {}

  struct Waiting {
    ObservationSubmission submission;  // REQUIRES: judged_at
    VerdictsCallback done;
    int64_t bytes = 0;  // of the submission, in the limits of the map's queue
  };

  // Takes a submission if it must wait; returns whether it did.
  bool TakeIfLate(const Snapshot& snapshot, Waiting& waiting);

  bool empty() const { return waiting_.empty() && !is_working(); }
  // The time until there is something to do; infinite if nothing waits. A work begins only when no
  // others have come for a while, because it costs hardly more for many than for one.
  absl::Duration UntilWork() const;

  // Folds in advance for one of the two works, until `stop`, which is asked after each entry of a
  // log, returns true. Returns the submissions to commit now, as one group and in this order: those
  // for which the work is done, or whose callers have all gone. Mostly there are none.
  std::vector<Waiting> Work(const Snapshot& snapshot, absl::FunctionRef<bool()> stop);

  // All that wait, in order.
  std::vector<Waiting> TakeAll();

 private:
  using Lane = FusedLayer::Lane;
  using Robot = std::pair<std::string, std::string>;  // layer and robot
  struct Entry {
    Waiting waiting;
    Lane lane = Lane::kNear;
    bool is_late = true;  // false: it waits only for an earlier one of its robot
    SteadyTime since;     // when it came
  };
  // The submissions for which one work is done, all of one layer; empty if there is none.
  struct Portion {
    std::vector<Waiting> submissions;
    bool has_begun = false;
    int64_t left = FusedLayer::kAllEntries;  // entries to fold

    bool empty() const { return submissions.empty(); }
  };

  bool is_working() const { return !lanes_[0].empty() || !lanes_[1].empty(); }
  static std::set<Robot> RobotsOf(const ObservationSubmission& submission);
  Portion& portion(Lane lane) { return lanes_[static_cast<int>(lane)]; }
  // Begins a portion with submissions that wait for the lane.
  void Gather(Lane lane);
  // Works for the lane; returns what can be committed.
  std::vector<Waiting> WorkFor(Lane lane, const Snapshot& snapshot, absl::FunctionRef<bool()> stop);
  // Ends a portion, and returns its submissions.
  std::vector<Waiting> End(Portion& portion);

  MapFusion* const fusion_;
  const Executor* const executor_;
  std::list<Entry> waiting_;  // in order of arrival
  std::array<Portion, FusedLayer::kNumLanes> lanes_;
  std::map<Robot, int> robots_;  // number of submissions of each that wait or are in a portion
  Lane next_ = Lane::kNear;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_LATE_OBSERVATIONS_H_
