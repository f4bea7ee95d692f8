// hypermap-ros2 shows maps of a Hypermap server to robots that run ROS 2: map topics, markers and
// services, without ROS on the machine where it runs (docs/ros2.md).
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/scoped_grpc.h"
#include "client_libs/flags/command_table.h"
#include "client_libs/flags/connection_flags.h"
#include "client_libs/ros2/bridge/map_bridge.h"
#include "client_libs/ros2/bridge/robot_reporter.h"
#include "client_libs/ros2/conversion/names.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {
namespace {

struct Flags {
  client::ConnectionFlags connection;
  std::vector<std::string> maps;
  std::vector<std::string> robots;
  MapBridgeOptions map;
  DdsOptions dds;
  std::string mode = "trinary";
  std::string distro = "jazzy";
  std::string keep_out;
  std::string speed;
  double send_again_seconds = 5.0;
};

void AddFlags(CLI::App& app, Flags& flags) {
  client::AddConnectionFlags(app, flags.connection);
  app.add_option(
         "--map", flags.maps,
         "Map to show; may be repeated: with several maps, all names of each begin with /MAP")
      ->required()
      ->type_name("MAP");
  app.add_option("--occupancy", flags.map.occupancy_layer,
                 "Layer of /map and of the masks (default: the first occupancy layer by name)")
      ->type_name("LAYER");
  app.add_option("--mode", flags.mode,
                 "Cells between free and occupied are unknown (trinary), or 1 to 99 (scale)")
      ->check(CLI::IsMember({"trinary", "scale"}))
      ->capture_default_str();
  app.add_option("--keep_out", flags.keep_out,
                 "Label or tag:TAG of the zones of /keepout_filter_mask (default: no such topic)")
      ->type_name("VALUE");
  app.add_option(
         "--speed", flags.speed,
         "Label or tag:TAG of the zones of /speed_filter_mask, whose attribute speed_limit is "
         "in metres per second (default: no such topic)")
      ->type_name("VALUE");
  app.add_option(
         "--send_again_seconds", flags.send_again_seconds,
         "After an update, the whole grid is sent again at the latest after so many seconds")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option("--max_answer_items", flags.map.max_answer_items,
                 "Largest number of locations in the answer of a service")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option(
         "--robot", flags.robots,
         "Reports the poses of a topic (geometry_msgs/msg/PoseWithCovarianceStamped) to the "
         "first map as those of a robot; may be repeated")
      ->type_name("NAME=TOPIC");
  app.add_option("--domain", flags.dds.domain, "Domain of ROS 2")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(0, 232))
      ->capture_default_str();
  app.add_option("--node", flags.dds.node_name, "Name of the node")->capture_default_str();
  app.add_option("--distro", flags.distro, "Distribution of the robots: humble, or a later one")
      ->capture_default_str();
  app.add_flag("--localhost", flags.dds.localhost_only,
               "Talk to this machine only, over 127.0.0.1 without multicast");
  app.add_option("--peer", flags.dds.peers,
                 "Address of a machine that multicast does not reach; may be repeated")
      ->type_name("ADDRESS");
}

absl::Status ReadZones(const std::string& text, std::optional<ValueQuery>* value) {
  if (text.empty()) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(*value, ParseValueQuery(text));
  return absl::OkStatus();
}

// Runs until SIGINT or SIGTERM.
absl::Status Run(Flags flags) {
  flags.map.mode = flags.mode == "scale" ? GridMode::kScale : GridMode::kTrinary;
  flags.map.node = absl::StrCat("/", flags.dds.node_name);
  flags.map.send_again_after = absl::Seconds(flags.send_again_seconds);
  flags.dds.gid_bytes = flags.distro == "humble" ? 24 : 16;
  HYPERMAP_RETURN_IF_ERROR(ReadZones(flags.keep_out, &flags.map.keep_out));
  HYPERMAP_RETURN_IF_ERROR(ReadZones(flags.speed, &flags.map.speed));
  // A server that is away is waited for by the bridge itself.
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::Client client,
      client::MakeClient(flags.connection, {.retry_for = absl::ZeroDuration()}));
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Participant> participant,
                            Participant::Make(flags.dds));
  std::vector<std::unique_ptr<MapBridge>> bridges;
  for (const std::string& map : flags.maps) {
    MapBridgeOptions options = flags.map;
    options.map = map;
    if (flags.maps.size() > 1) options.name_prefix = absl::StrCat("/", NameInRos(map));
    HYPERMAP_ASSIGN_OR_RETURN(bridges.emplace_back(),
                              MapBridge::Start(participant.get(), client, std::move(options)));
  }
  std::vector<std::unique_ptr<RobotReporter>> reporters;
  for (const std::string& robot : flags.robots) {
    HYPERMAP_ASSIGN_OR_RETURN(const RobotTopic topic, ParseRobotTopic(robot));
    HYPERMAP_ASSIGN_OR_RETURN(
        reporters.emplace_back(),
        RobotReporter::Start(participant.get(), client, flags.maps.front(), topic));
  }
  std::cout << "hypermap-ros2 ready on domain " << flags.dds.domain << std::endl;
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  int signal = 0;
  sigwait(&ends, &signal);
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  Flags flags;
  CLI::App app("Shows maps of a Hypermap server to robots that run ROS 2.", "hypermap-ros2");
  app.set_version_flag("--version", "hypermap-ros2 " HYPERMAP_VERSION);
  AddFlags(app, flags);
  client::AddCommandTableOption(app);
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = Run(std::move(flags));
  if (status.ok()) return EXIT_SUCCESS;
  std::cerr << "hypermap-ros2: " << status << "\n";
  return EXIT_FAILURE;
}

}  // namespace
}  // namespace hypermap::ros2

int main(int argc, char** argv) {
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  // Before any thread starts, so that all of them leave these signals to sigwait.
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  hypermap::logging::Start(hypermap::logging::Level::kInfo, hypermap::logging::Format::kText);
  const hypermap::client::ScopedGrpc grpc;
  return hypermap::ros2::Main(argc, argv);
}
