#include "ingest/worker/serve_command.h"

#include <cstdint>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "base/admission/file_limit.h"
#include "base/admission/memory.h"
#include "base/status/status_macros.h"
#include "base/sync/steady_time.h"
#include "client_libs/cpp/client.h"
#include "ingest/frame_service/frame_server.h"
#include "ingest/perception/observer.h"
#include "ingest/sources/occupancy_file.h"
#include "ingest/worker/target_layer.h"
#include "ingest/worker/target_options.h"

namespace hypermap::ingest {
namespace {

// Files that are open at once besides connections of robots.
constexpr int64_t kFilesOfServer = 64;

// The arguments of the command line.
struct ServeArguments {
  FrameServerOptions server;
  TargetLayer target;
  std::string segmenter = "organised";
  std::string occupancy = "none";
};

absl::Status Run(ServeArguments arguments, const Interruption& interruption) {
  std::shared_ptr<const GridLayer> occupancy;
  if (arguments.occupancy != "none") {
    HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const GridLayer> layer,
                              ReadOccupancy(arguments.occupancy));
    occupancy = std::move(layer);
  }
  const TargetLayer& target = arguments.target;
  HYPERMAP_ASSIGN_OR_RETURN(
      client::Client client,
      client::MakeClient(target.connection, {.retry_for = absl::ZeroDuration()}));
  HYPERMAP_RETURN_IF_ERROR(EnsureTarget(client, target));
  FrameServerOptions& options = arguments.server;
  options.map = target.map;
  options.layer = target.layer;
  options.observe = ObserveOptionsOf(target);
  // One write, so that lines of several threads do not mix.
  options.log = [](const std::string& line) { std::cerr << line + "\n"; };
  HYPERMAP_ASSIGN_OR_RETURN(
      options.connections,
      admission::LimitConnections({0, 0}, admission::RaiseFileLimit(), kFilesOfServer));
  if (options.memory_limit == 0) options.memory_limit = admission::UsableMemory() / 4 * 3;
  options.max_resident_bytes = options.memory_limit;
  auto observer = std::make_shared<const Observer>(MakeSegmenter(arguments.segmenter),
                                                   std::move(occupancy), ObserverOptions());
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<FrameServer> server,
                            FrameServer::Start(options, client, std::move(observer)));
  std::cout << "hypermap-ingest ready on " << server->address() << std::endl;
  interruption.WaitUntil(SteadyTime::InfiniteFuture());
  server->Shutdown();
  return absl::OkStatus();
}

}  // namespace

void AddServeCommand(CLI::App& app, Command& selected) {
  auto arguments = std::make_shared<ServeArguments>();
  CLI::App* command =
      app.add_subcommand("serve", "Receive frames from robots and send observations to a server");
  arguments->server.listen = "127.0.0.1:50052";
  command
      ->add_option("--listen", arguments->server.listen,
                   "Address to serve on; port 0 chooses a free port")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  AddTargetOptions(*command, arguments->target);
  AddSegmenterOption(*command, arguments->segmenter);
  command
      ->add_option("--occupancy", arguments->occupancy,
                   "nav2 YAML file of the map with which poses are refined, or none")
      ->type_name("FILE")
      ->capture_default_str();
  command
      ->add_option("--queue", arguments->server.queue, "Maximum number of queued frames per robot")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--max_queue_bytes", arguments->server.max_queue_bytes,
                   "Bytes of memory of a robot's queued frames at which the queue is full")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--max_streams", arguments->server.max_streams,
                   "Streams that may be open at once; half of them for one client address. They "
                   "share a connection to the server, which has --max_calls_per_connection")
      ->check(CLI::Range(2, 10'000))
      ->capture_default_str();
  arguments->server.memory_limit = 0;
  command
      ->add_option("--memory_limit", arguments->server.memory_limit,
                   "Bytes of memory above which streams are refused; half of them for one client "
                   "address; 0: three quarters of the memory of the machine or the control group")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->callback([arguments, &selected] {
    selected = [arguments](const Interruption& interruption) {
      return Run(*arguments, interruption);
    };
  });
}

}  // namespace hypermap::ingest
