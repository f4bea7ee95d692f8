// hypermap-ros2 shows maps of a Hypermap server to robots that run ROS 2: map topics, markers and
// services, without ROS on the machine where it runs (docs/ros2.md).
#include <unistd.h>

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
#include "client_libs/ros2/bridge/detection_feed.h"
#include "client_libs/ros2/bridge/map_bridge.h"
#include "client_libs/ros2/bridge/map_poses.h"
#include "client_libs/ros2/bridge/robot_reporter.h"
#include "client_libs/ros2/camera_flags.h"
#include "client_libs/ros2/conversion/names.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::Duration kMapTimeout = absl::Seconds(5);
constexpr unsigned kGraceSeconds = 5;

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
  MapPosesOptions poses;
  std::string map_frame;
  std::string frame_id;
  double max_pose_gap = 0.5;
  CameraFlags camera;
};

void AddPoseFlags(CLI::App& app, Flags& flags) {
  app.add_option(
         "--robot", flags.robots,
         "Reports the poses of a topic (geometry_msgs/msg/PoseWithCovarianceStamped), or those of "
         "a frame of tf in the map's frame, to the first map as those of a robot; may be repeated")
      ->type_name("NAME=/TOPIC|NAME=tf:FRAME");
  app.add_option("--tf", flags.poses.tf, "Topic of tf")->type_name("TOPIC")->capture_default_str();
  app.add_option("--tf_static", flags.poses.tf_static, "Topic of static transforms")
      ->type_name("TOPIC")
      ->capture_default_str();
  app.add_option("--map_frame", flags.map_frame,
                 "Frame of tf in which poses are told (default: the first map's own; `map` without "
                 "a map)")
      ->type_name("FRAME");
  app.add_option("--frame_id", flags.frame_id,
                 "What Hypermap calls the frame of --map_frame (default: the map's own)")
      ->type_name("FRAME");
  app.add_option("--max_pose_gap", flags.max_pose_gap,
                 "Largest seconds between samples of tf to interpolate")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
}

void AddFlags(CLI::App& app, Flags& flags) {
  client::AddConnectionFlags(app, flags.connection);
  app.add_option(
         "--map", flags.maps,
         "Map to show; may be repeated: with several maps, all names of each begin with /MAP")
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
  AddPoseFlags(app, flags);
  AddCameraFlags(app, flags.camera);
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

// What runs until the program ends.
struct Running {
  std::unique_ptr<Participant> participant;
  std::vector<std::unique_ptr<MapBridge>> bridges;
  std::unique_ptr<MapPoses> poses;  // null if nobody needs them
  std::vector<std::unique_ptr<RobotReporter>> reporters;
  std::unique_ptr<DetectionFeed> feed;
};

absl::Status StartBridges(const Flags& flags, const client::Client& client, Running* running) {
  for (const std::string& map : flags.maps) {
    MapBridgeOptions options = flags.map;
    options.map = map;
    if (flags.maps.size() > 1) options.name_prefix = absl::StrCat("/", NameInRos(map));
    HYPERMAP_ASSIGN_OR_RETURN(
        running->bridges.emplace_back(),
        MapBridge::Start(running->participant.get(), client, std::move(options)));
  }
  return absl::OkStatus();
}

// Starts to listen to tf, unless that was done.
absl::Status StartPoses(const Flags& flags, const client::Client& client, Running* running) {
  if (running->poses != nullptr) return absl::OkStatus();
  MapPosesOptions options = flags.poses;
  options.max_gap = absl::Seconds(flags.max_pose_gap);
  if (flags.map_frame.empty() && !flags.maps.empty()) {
    options.find_map_frame = [client = client,
                              map = flags.maps.front()]() mutable -> absl::StatusOr<std::string> {
      HYPERMAP_ASSIGN_OR_RETURN(const client::MapEntry entry,
                                client.GetMap(map, {.timeout = kMapTimeout}));
      return entry.frame_id;
    };
  } else {
    options.find_map_frame = [name = flags.map_frame.empty() ? "map" : flags.map_frame] {
      return name;
    };
  }
  HYPERMAP_ASSIGN_OR_RETURN(running->poses,
                            MapPoses::Start(running->participant.get(), std::move(options)));
  return absl::OkStatus();
}

absl::Status StartReporters(const Flags& flags, const client::Client& client, Running* running) {
  for (const std::string& robot : flags.robots) {
    HYPERMAP_ASSIGN_OR_RETURN(const RobotSource source, ParseRobotSource(robot));
    auto& reporter = running->reporters.emplace_back();
    if (source.frame.empty()) {
      HYPERMAP_ASSIGN_OR_RETURN(reporter, RobotReporter::OfTopic(running->participant.get(), client,
                                                                 flags.maps.front(), source));
      continue;
    }
    HYPERMAP_RETURN_IF_ERROR(StartPoses(flags, client, running));
    HYPERMAP_ASSIGN_OR_RETURN(reporter, RobotReporter::OfFrame(running->poses.get(), flags.frame_id,
                                                               client, flags.maps.front(), source));
  }
  return absl::OkStatus();
}

absl::Status StartFeed(const Flags& flags, const client::Client& client, Running* running) {
  if (!flags.camera.is_set()) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(DetectionFeedOptions options,
                            FeedOptionsOf(flags.camera, absl::Seconds(flags.max_pose_gap)));
  options.frame_id = flags.frame_id;
  HYPERMAP_RETURN_IF_ERROR(StartPoses(flags, client, running));
  HYPERMAP_ASSIGN_OR_RETURN(
      running->feed,
      DetectionFeed::Start(running->participant.get(), running->poses.get(), std::move(options)));
  return absl::OkStatus();
}

// Ends the process after this time if it still runs, because a call to a silent server goes on.
void EndWithin(unsigned seconds) {
  std::signal(SIGALRM, [](int) { _exit(EXIT_SUCCESS); });
  alarm(seconds);
}

// Runs until SIGINT or SIGTERM.
absl::Status Run(Flags flags) {
  flags.map.mode = flags.mode == "scale" ? GridMode::kScale : GridMode::kTrinary;
  flags.map.node = absl::StrCat("/", flags.dds.node_name);
  flags.map.send_again_after = absl::Seconds(flags.send_again_seconds);
  flags.dds.gid_bytes = flags.distro == "humble" ? 24 : 16;
  if (flags.maps.empty() && (!flags.camera.is_set() || !flags.robots.empty())) {
    return absl::InvalidArgumentError("--map is required, unless there is --ingest alone");
  }
  HYPERMAP_RETURN_IF_ERROR(ReadZones(flags.keep_out, &flags.map.keep_out));
  HYPERMAP_RETURN_IF_ERROR(ReadZones(flags.speed, &flags.map.speed));
  // A server that is away is waited for by the bridge itself.
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::Client client,
      client::MakeClient(flags.connection, {.retry_for = absl::ZeroDuration()}));
  Running running;
  HYPERMAP_ASSIGN_OR_RETURN(running.participant, Participant::Make(flags.dds));
  HYPERMAP_RETURN_IF_ERROR(StartBridges(flags, client, &running));
  HYPERMAP_RETURN_IF_ERROR(StartReporters(flags, client, &running));
  HYPERMAP_RETURN_IF_ERROR(StartFeed(flags, client, &running));
  std::cout << "hypermap-ros2 ready on domain " << flags.dds.domain << std::endl;
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  int signal = 0;
  sigwait(&ends, &signal);
  EndWithin(kGraceSeconds);
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
