#include "client_libs/cli/robot_json.h"

#include <utility>

namespace hypermap::cli {
namespace {

// Nine numbers, row-major.
Json CovarianceJson(const Eigen::Matrix3d& covariance) {
  Json numbers = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) numbers.push_back(covariance(row, col));
  }
  return numbers;
}

}  // namespace

Json RobotJson(const client::RobotPresence& robot) {
  const client::RobotReport& report = robot.report;
  Json json = {{"robot", report.robot},
               {"online", robot.online},
               {"seen", TimeJson(robot.seen_at)},
               {"measured", TimeJson(report.stamp)},
               {"frame_id", report.frame_id},
               {"in_map_frame", robot.in_map_frame},
               {"pose", PoseJson(report.frame_from_robot)}};
  if (report.covariance) json["covariance"] = CovarianceJson(*report.covariance);
  if (report.map_revision) json["map_revision"] = *report.map_revision;
  if (report.map_incarnation != 0) json["map_incarnation"] = report.map_incarnation;
  if (report.battery) json["battery"] = *report.battery;
  json["state"] = report.state;
  json["fields"] = report.fields;
  return json;
}

Json ReportJson(const RobotsReport& report) {
  Json robots = Json::array();
  for (const client::RobotPresence& robot : report.list.robots) robots.push_back(RobotJson(robot));
  return {{"map", report.map},
          {"revision", report.list.at.revision},
          {"frame_id", report.list.at.frame_id},
          {"time", TimeJson(report.list.at.time)},
          {"robots", std::move(robots)}};
}

}  // namespace hypermap::cli
