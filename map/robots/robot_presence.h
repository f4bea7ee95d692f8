// What a server tells of the robots of a map.
#ifndef HYPERMAP_MAP_ROBOTS_ROBOT_PRESENCE_H_
#define HYPERMAP_MAP_ROBOTS_ROBOT_PRESENCE_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/frames/frame_tree.h"
#include "map/robots/robot_report.h"
#include "map/snapshot.h"

namespace hypermap {

// A robot, as the server last heard of it.
struct RobotPresence {
  // The newest report.
  RobotReport report;
  // Whether the pose is in the map's own frame; otherwise it is in the frame of the report.
  bool in_map_frame = false;
  // Whether the robot has reported lately.
  bool online = false;
  // Time at which the report came, by the server's clock.
  absl::Time seen_at;

  friend bool operator==(const RobotPresence&, const RobotPresence&) = default;
};

// Returns the robot with its pose in the map's own frame, `map_frame_id`; as it was reported if the
// frame of the report is not connected to that one, or too far away.
RobotPresence InMapFrame(RobotPresence robot, const FrameTree& frames,
                         const std::string& map_frame_id);

// What a report brought about.
struct ReportAnswer {
  // Newest revision of the map, and its incarnation.
  Revision revision = 0;
  uint64_t incarnation = 0;
  // False if the server has a report with a later stamp, and ignored this one.
  bool accepted = false;
};

// What the answers about the robots of a map have in common.
struct RobotsAt {
  // The revision whose transforms were used, and its incarnation.
  Revision revision = 0;
  uint64_t incarnation = 0;
  // The map's own frame.
  std::string frame_id;
  // Time of the answer by the server's clock.
  absl::Time time;

  friend bool operator==(const RobotsAt&, const RobotsAt&) = default;
};

// All robots of a map.
struct RobotList {
  RobotsAt at;
  // Sorted by name.
  std::vector<RobotPresence> robots;
};

// A part of what a watch of robots tells.
struct RobotChanges {
  RobotsAt at;
  // Whether this and the parts that follow contain all robots, so that the reader must forget those
  // that it knew.
  bool reset = false;
  // Whether more parts of this state follow.
  bool more = false;
  // Robots that are new or have changed.
  std::vector<RobotPresence> robots;
  // Names of robots that the server has forgotten.
  std::vector<std::string> forgotten;
};

// Carries the changes out in `robots`, which has the robots by name, and is empty at first.
void CarryOut(const RobotChanges& changes, std::map<std::string, RobotPresence>* robots);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_ROBOTS_ROBOT_PRESENCE_H_
