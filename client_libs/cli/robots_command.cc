// robots.
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {
namespace {

struct RobotsCommand {
  std::string map;
  bool follow = false;
};

absl::Status List(const RobotsCommand& command, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(client::RobotList list, s.client.ListRobots(command.map));
  s.output.Show(RobotsReport{command.map, std::move(list)});
  return absl::OkStatus();
}

absl::Status Follow(const RobotsCommand& command, Session& s) {
  client::CallOptions call;
  call.timeout = s.timeout;
  client::RobotReader reader = s.client.WatchRobots(command.map, call);
  while (const std::optional<client::RobotChanges> changes = reader.Next()) {
    s.output.Show(*changes);
  }
  return reader.status();
}

}  // namespace

void AddRobotsCommand(CLI::App& app, Command& selected) {
  auto command = std::make_shared<RobotsCommand>();
  CLI::App* robots = app.add_subcommand("robots", "Show where the robots of a map are");
  robots->add_option("map", command->map, "Name of the map")->required()->type_name("MAP");
  robots->add_flag("--follow", command->follow,
                   "Print a line for each robot, and another whenever it changes");
  robots->callback([&selected, command] {
    selected = [command](Session& s) {
      return command->follow ? Follow(*command, s) : List(*command, s);
    };
  });
}

}  // namespace hypermap::cli
