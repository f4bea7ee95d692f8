#include "client_libs/cli/robot_tables.h"

#include "absl/strings/str_cat.h"
#include "client_libs/cli/describe.h"
#include "client_libs/cli/text_table.h"

namespace hypermap::cli {
namespace {

const char* StateOf(const client::RobotPresence& robot) {
  return robot.online ? "online" : "offline";
}

std::string BatteryPercent(const client::RobotReport& report) {
  return report.battery ? FormatNumber(100.0 * *report.battery, 0) : "";
}

}  // namespace

void PrintRobots(const client::RobotList& list, std::ostream& out) {
  TextTable table({"ROBOT", "STATE", "SEEN [s ago]", "X [m]", "Y [m]", "YAW [rad]", "FRAME",
                   "BATTERY [%]", "REVISION", "DOING"});
  for (const client::RobotPresence& robot : list.robots) {
    const client::RobotReport& report = robot.report;
    table.AddRow(
        {report.robot, StateOf(robot),
         FormatNumber(absl::ToDoubleSeconds(list.at.time - robot.seen_at), 1),
         FormatNumber(report.frame_from_robot.x()), FormatNumber(report.frame_from_robot.y()),
         FormatNumber(report.frame_from_robot.yaw()), report.frame_id, BatteryPercent(report),
         report.map_revision ? absl::StrCat(*report.map_revision) : "", report.state});
  }
  if (!table.empty()) table.Print(out);
}

std::string DescribeRobot(const client::RobotPresence& robot) {
  const client::RobotReport& report = robot.report;
  std::string text =
      absl::StrCat(report.robot, "  ", StateOf(robot), "  ",
                   DescribePoint({report.frame_from_robot.x(), report.frame_from_robot.y()}),
                   " in ", report.frame_id, ", yaw ", FormatNumber(report.frame_from_robot.yaw()));
  if (report.battery) absl::StrAppend(&text, ", battery ", BatteryPercent(report), " %");
  if (!report.state.empty()) absl::StrAppend(&text, ", ", report.state);
  return text;
}

}  // namespace hypermap::cli
