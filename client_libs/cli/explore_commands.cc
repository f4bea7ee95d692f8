// explore start, status, list, frontiers, stop.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/coordinates.h"
#include "client_libs/cli/validators.h"

namespace hypermap::cli {
namespace {

struct ExploreOptions {
  std::string map;
  ObjectId id = 0;
  std::string frame_id;
  std::string occupancy_layer;
  std::string exploration_layer = "explored";
  std::vector<std::string> area;
  client::StartOptions start;
  std::string rule = "centre";
  bool with_cells = false;
};

absl::Status Start(const ExploreOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const Polygon area, ParsePolygon(options.area));
  client::StartOptions start = options.start;
  start.frame_id = options.frame_id;
  start.explored_rule = ParseCellRule(options.rule).value_or(CellRule::kCentre);
  HYPERMAP_ASSIGN_OR_RETURN(client::StartAnswer answer,
                            s.client.StartExploration(options.map, area, options.occupancy_layer,
                                                      options.exploration_layer, start));
  s.output.Show(ExplorationReport{options.map, answer.revision, std::move(answer.entry), {}});
  return absl::OkStatus();
}

absl::Status ShowStatus(const ExploreOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(client::ExplorationAnswer answer,
                            s.client.GetExploration(options.map, options.id, options.frame_id));
  s.output.Show(
      ExplorationReport{options.map, answer.revision, std::move(answer.entry), answer.progress});
  return absl::OkStatus();
}

absl::Status List(const ExploreOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(client::ExplorationList list,
                            s.client.ListExplorations(options.map, options.frame_id));
  s.output.Show(ExplorationsReport{options.map, std::move(list)});
  return absl::OkStatus();
}

absl::Status ListFrontiers(const ExploreOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(
      client::FrontierList list,
      s.client.ListFrontiers(options.map, options.id, options.frame_id, options.with_cells));
  s.output.Show(FrontiersReport{options.map, std::move(list)});
  return absl::OkStatus();
}

absl::Status Stop(const ExploreOptions& options, Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(client::ExplorationEntry entry,
                            s.client.StopExploration(options.map, options.id));
  s.output.Show(ExplorationReport{.map = options.map, .entry = std::move(entry)});
  return absl::OkStatus();
}

void AddFrame(CLI::App& command, ExploreOptions& options) {
  command.add_option("--frame", options.frame_id,
                     "Frame of the coordinates (default: the map's own)");
}

void AddId(CLI::App& command, ExploreOptions& options) {
  command.add_option("id", options.id, "Id of the exploration (default: the newest)")
      ->type_name("ID")
      ->check(CLI::PositiveNumber);
}

void AddStartOptions(CLI::App& start, ExploreOptions& options) {
  start
      .add_option("--occupancy", options.occupancy_layer,
                  "Layer whose free cells are the floor to explore")
      ->required()
      ->type_name("LAYER");
  start
      .add_option("--layer", options.exploration_layer,
                  "Exploration layer for the explored floor; created if there is none")
      ->type_name("LAYER")
      ->capture_default_str();
  start.add_option("--area", options.area, "Vertices of the area to explore, in order")
      ->required()
      ->type_name("X,Y")
      ->check(IsPoint());
  start
      .add_option("--robot_radius,--robot-radius", options.start.robot_radius_m,
                  "Radius of the robots in metres; they keep this far from cells that are not free")
      ->type_name("METRES")
      ->check(IsNumber())
      ->capture_default_str();
  start.add_option("--range", options.start.range_m, "Range of the robots' sensors in metres")
      ->type_name("METRES")
      ->check(IsNumber())
      ->capture_default_str();
  start
      .add_option("--min_gain,--min-gain", options.start.min_gain_cells,
                  "Skip viewpoints that would reveal fewer new cells than this")
      ->type_name("CELLS")
      ->capture_default_str();
  start
      .add_option("--rule", options.rule,
                  "Rule for explored cells if the layer is created: centre, covered or touched")
      ->check(IsCellRule())
      ->capture_default_str();
}

// Adds a subcommand for a map, with its action.
CLI::App* AddSubcommand(CLI::App& explore, const std::string& name, const std::string& description,
                        const std::shared_ptr<ExploreOptions>& options, Command& selected,
                        absl::Status (*run)(const ExploreOptions&, Session&)) {
  CLI::App* command = explore.add_subcommand(name, description);
  command->add_option("map", options->map, "Name of the map")->required()->type_name("MAP");
  command->callback([&selected, options, run] {
    selected = [options, run](Session& s) { return run(*options, s); };
  });
  return command;
}

}  // namespace

void AddExploreCommands(CLI::App& app, Command& selected) {
  auto options = std::make_shared<ExploreOptions>();
  CLI::App* explore =
      app.add_subcommand("explore", "Explore an area of a map with robots")->require_subcommand(1);

  CLI::App* start = AddSubcommand(*explore, "start", "Start the exploration of an area", options,
                                  selected, Start);
  AddFrame(*start, *options);
  AddStartOptions(*start, *options);

  CLI::App* status = AddSubcommand(*explore, "status", "Show the progress of an exploration",
                                   options, selected, ShowStatus);
  AddId(*status, *options);
  AddFrame(*status, *options);

  CLI::App* list = AddSubcommand(*explore, "list", "List the explorations, newest first", options,
                                 selected, List);
  AddFrame(*list, *options);

  CLI::App* frontiers = AddSubcommand(*explore, "frontiers",
                                      "List the frontiers between explored and unexplored floor",
                                      options, selected, ListFrontiers);
  AddId(*frontiers, *options);
  AddFrame(*frontiers, *options);
  frontiers->add_flag("--cells", options->with_cells, "Include the centre of each cell");

  CLI::App* stop = AddSubcommand(*explore, "stop", "Stop an exploration", options, selected, Stop);
  AddId(*stop, *options);
}

}  // namespace hypermap::cli
