// Reads the paths of robots from files.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_ROBOT_PATHS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_ROBOT_PATHS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/point.h"

namespace hypermap::cli {

struct RobotPath {
  std::string robot;
  std::vector<Point> points;  // in order; at least one

  friend bool operator==(const RobotPath&, const RobotPath&) = default;
};

// Reads the LineStrings of a GeoJSON FeatureCollection, each with the property "robot".
// INVALID_ARGUMENT naming the first feature that is something else. Lines without points are left
// out.
absl::StatusOr<std::vector<RobotPath>> ReadRobotPaths(absl::string_view geojson);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_ROBOT_PATHS_H_
