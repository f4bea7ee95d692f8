#include "map/robots/robot_presence.h"

#include <utility>

#include "absl/status/statusor.h"

namespace hypermap {

RobotPresence InMapFrame(RobotPresence robot, const FrameTree& frames,
                         const std::string& map_frame_id) {
  if (robot.report.frame_id.empty()) robot.report.frame_id = map_frame_id;
  const absl::StatusOr<PlanarTransform> map_from_frame =
      frames.Lookup(map_frame_id, robot.report.frame_id);
  if (!map_from_frame.ok()) return robot;
  if (!map_from_frame->IsIdentity()) {
    robot.report = Transformed(std::move(robot.report), *map_from_frame, map_frame_id);
  }
  robot.report.frame_id = map_frame_id;
  robot.in_map_frame = true;
  return robot;
}

void CarryOut(const RobotChanges& changes, std::map<std::string, RobotPresence>* robots) {
  if (changes.reset) robots->clear();
  for (const std::string& name : changes.forgotten) robots->erase(name);
  for (const RobotPresence& robot : changes.robots) (*robots)[robot.report.robot] = robot;
}

}  // namespace hypermap
