#include "ingest/worker/smooth_command.h"

#include <iostream>
#include <memory>
#include <string>

#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/flags/connection_flags.h"
#include "ingest/worker/summary_output.h"

namespace hypermap::ingest {
namespace {

// The arguments of the command line.
struct SmoothArguments {
  client::ConnectionFlags connection;
  std::string map;
  std::string layer = "semantic";
  std::string occupancy_layer;
};

absl::Status Run(const SmoothArguments& arguments) {
  HYPERMAP_ASSIGN_OR_RETURN(client::Client client,
                            client::MakeClient(arguments.connection, client::ClientOptions()));
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::SmoothingAnswer smoothed,
      client.SmoothPoses(arguments.map, arguments.layer, arguments.occupancy_layer));
  std::cout << arguments.map << ": " << SmoothingText(smoothed) << ", revision "
            << smoothed.revision << "\n";
  return absl::OkStatus();
}

}  // namespace

void AddSmoothCommand(CLI::App& app, Command& selected) {
  auto arguments = std::make_shared<SmoothArguments>();
  SmoothArguments& a = *arguments;
  CLI::App* command = app.add_subcommand(
      "smooth", "Compute better poses for observations from what they have in common");
  client::AddConnectionFlags(*command, a.connection);
  command->add_option("--map", a.map, "Name of the map")->required();
  command->add_option("--layer", a.layer, "Fused layer")->capture_default_str();
  command->add_option("--occupancy_layer", a.occupancy_layer,
                      "Occupancy grid whose walls are used (default: the map's only one)");
  command->callback([arguments, &selected] {
    selected = [arguments](const Interruption&) { return Run(*arguments); };
  });
}

}  // namespace hypermap::ingest
