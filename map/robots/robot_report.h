// What robots report of themselves: where they are, and how they are doing.
#ifndef HYPERMAP_MAP_ROBOTS_ROBOT_REPORT_H_
#define HYPERMAP_MAP_ROBOTS_ROBOT_REPORT_H_

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/frames/planar_transform.h"
#include "map/snapshot.h"

namespace hypermap {

// A report of one robot. The fields are those of v1::RobotReport.
struct RobotReport {
  std::string robot;
  // Time of the pose by the robot's clock.
  absl::Time stamp;
  // The frame of the pose. Empty: the map's own.
  std::string frame_id;
  PlanarTransform frame_from_robot;
  // Of (x, y, yaw), metres and radians.
  std::optional<Eigen::Matrix3d> covariance;
  // The newest revision of the map that the robot holds, and its incarnation; 0: not told.
  std::optional<Revision> map_revision;
  uint64_t map_incarnation = 0;
  // In [0, 1].
  std::optional<double> battery;
  // What the robot is doing, and anything else, for people.
  std::string state;
  std::map<std::string, std::string> fields;

  friend bool operator==(const RobotReport&, const RobotReport&) = default;
};

// INVALID_ARGUMENT unless this can be the name of a robot.
absl::Status CheckRobotName(absl::string_view robot);

// INVALID_ARGUMENT naming the field that is outside of its bounds: FixedLimits, and what
// v1::RobotReport says.
absl::Status Validate(const RobotReport& report);

// Returns the report with its pose and covariance in the frame `target_frame_id`.
RobotReport Transformed(RobotReport report, const PlanarTransform& target_from_source,
                        const std::string& target_frame_id);

// Bytes of memory that the report takes: an estimate.
int64_t ByteSize(const RobotReport& report);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_ROBOTS_ROBOT_REPORT_H_
