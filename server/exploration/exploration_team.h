// The robots of an exploration, and the choice of their goals.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_TEAM_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_TEAM_H_

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/explorer.h"
#include "map/geometry/point.h"
#include "server/exploration/exploration_follower.h"

namespace hypermap::server {

// Keeps the last reported position of each robot, in memory only: after a restart, robots report it
// again with their next claim. Places are in the frame of the exploration's objects. REQUIRES of
// all methods: `follower` was updated to the snapshot that `objects` come from. Not thread safe.
class ExplorationTeam {
 public:
  // Records that `robot` is at `place`. Returns false if there are FixedLimits::kMaxRobots others.
  // REQUIRES: a robot can stand there.
  bool Meet(const std::string& robot, const Point& place, absl::Time now,
            ExplorationFollower* follower);

  // The viewpoint that `robot` should go to next; nullopt if there is nothing for it to see that
  // the goals of other robots will not show. REQUIRES: Meet was called for the robot.
  std::optional<Explorer::ChosenViewpoint> Choose(const std::string& robot,
                                                  const ExplorationObjects& objects,
                                                  ExplorationFollower* follower) const;

  // The reason to end the exploration after Choose found nothing for `robot`. kNone while another
  // robot has a goal, or has claimed one lately and would get another.
  EndReason ReasonToEnd(const std::string& robot, const ExplorationObjects& objects,
                        ExplorationFollower* follower) const;

 private:
  struct Met {
    Point place;
    absl::Time at;
  };

  std::map<std::string, Met> robots_;
  int told_generation_ = 0;  // generation of the Explorer that was told of robots_
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_TEAM_H_
