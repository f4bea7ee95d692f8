// Robots as text for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_ROBOT_TABLES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_ROBOT_TABLES_H_

#include <ostream>
#include <string>

#include "client_libs/cpp/robots.h"

namespace hypermap::cli {

// Prints one row for each robot.
void PrintRobots(const client::RobotList& list, std::ostream& out);

// The robot in one line: "r1  online  (1.5, 2) in map, yaw 0.5, battery 80 %, driving".
std::string DescribeRobot(const client::RobotPresence& robot);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_ROBOT_TABLES_H_
