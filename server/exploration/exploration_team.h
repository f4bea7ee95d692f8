// The robots that explore an area, and where they are sent.
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

// Remembers where robots were when they asked last: in memory, so that a restart forgets it until
// they ask again. Places are in the frame of the exploration's objects. The follower's Explorer is
// up to the snapshot that the objects are of. Not thread safe.
class ExplorationTeam {
 public:
  static constexpr size_t kMaxRobots = 256;

  // `robot` is at `place`, where it can stand. False when there are too many others.
  bool Meet(const std::string& robot, const Point& place, absl::Time now,
            ExplorationFollower* follower);

  // Where a robot that was met should look from next. Nothing when others are on the way to all
  // that it could see.
  std::optional<Explorer::Goal> Choose(const std::string& robot, const ExplorationObjects& objects,
                                       ExplorationFollower* follower) const;

  // Why the exploration is over, now that there is nothing for `robot`, which was just met; kNone
  // while another one is on its way, or asked lately and would be sent somewhere.
  EndReason ReasonToEnd(const std::string& robot, const ExplorationObjects& objects,
                        ExplorationFollower* follower) const;

 private:
  struct Met {
    Point place;
    absl::Time at;
  };

  std::map<std::string, Met> robots_;
  int told_generation_ = 0;  // of the Explorer that knows of them
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_TEAM_H_
