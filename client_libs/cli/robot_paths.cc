#include "client_libs/cli/robot_paths.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::cli {
namespace {

using nlohmann::json;

// Returns a member of an object; null if there is none.
const json& MemberOf(const json& object, const char* name) {
  static const json* const kNone = new json();
  if (!object.is_object()) return *kNone;
  const auto member = object.find(name);
  return member == object.end() ? *kNone : *member;
}

// Returns nullopt unless the value is two finite numbers, optionally followed by a height.
std::optional<Point> ParsePosition(const json& position) {
  if (!position.is_array() || position.size() < 2 || !position[0].is_number() ||
      !position[1].is_number()) {
    return std::nullopt;
  }
  return Point{position[0].get<double>(), position[1].get<double>()};
}

// Returns nullopt unless the feature is a robot's line.
std::optional<RobotPath> ParseFeature(const json& feature) {
  const json& robot = MemberOf(MemberOf(feature, "properties"), "robot");
  const json& geometry = MemberOf(feature, "geometry");
  const json& coordinates = MemberOf(geometry, "coordinates");
  if (!robot.is_string() || MemberOf(geometry, "type") != "LineString" || !coordinates.is_array()) {
    return std::nullopt;
  }
  RobotPath path{robot.get<std::string>(), {}};
  for (const json& position : coordinates) {
    const std::optional<Point> point = ParsePosition(position);
    if (!point.has_value()) return std::nullopt;
    path.points.push_back(*point);
  }
  return path;
}

}  // namespace

absl::StatusOr<std::vector<RobotPath>> ReadRobotPaths(absl::string_view geojson) {
  const json root = json::parse(geojson.begin(), geojson.end(), /*cb=*/nullptr,
                                /*allow_exceptions=*/false);
  const json& features = MemberOf(root, "features");
  if (MemberOf(root, "type") != "FeatureCollection" || !features.is_array()) {
    return absl::InvalidArgumentError("not a GeoJSON FeatureCollection");
  }
  std::vector<RobotPath> paths;
  for (size_t i = 0; i < features.size(); ++i) {
    std::optional<RobotPath> path = ParseFeature(features[i]);
    if (!path.has_value()) {
      return absl::InvalidArgumentError(
          absl::StrCat("features[", i, "] is not a LineString with the property \"robot\""));
    }
    if (!path->points.empty()) paths.push_back(*std::move(path));
  }
  return paths;
}

}  // namespace hypermap::cli
