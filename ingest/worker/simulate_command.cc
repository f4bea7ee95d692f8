#include "ingest/worker/simulate_command.h"

#include <unistd.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status/status_macros.h"
#include "ingest/worker/expedition_output.h"
#include "ingest/worker/progress_line.h"

namespace hypermap::ingest {
namespace {

// The arguments of the command line.
struct SimulateArguments {
  robots::ExpeditionOptions expedition;
  client::ConnectionFlags connection;
  std::vector<std::string> area;
  std::vector<std::string> starts;
  std::string detector = "ideal";
  std::string pose = "true";
  std::string rule = "touched";
  std::string ways_path;
  std::string truth_path;
  bool json = false;
};

std::optional<Point> ParsePoint(const std::string& text) {
  const std::vector<std::string> words = absl::StrSplit(text, ',');
  Point p;
  if (words.size() != 2 || !absl::SimpleAtod(words[0], &p.x) || !absl::SimpleAtod(words[1], &p.y) ||
      !IsFinite(p)) {
    return std::nullopt;
  }
  return p;
}

CLI::Validator IsPoint() {
  return CLI::Validator(
      [](std::string& text) { return ParsePoint(text) ? std::string() : "must be X,Y in metres"; },
      "X,Y");
}

absl::Status WriteFile(const std::string& path, const std::string& data) {
  if (path.empty()) return absl::OkStatus();
  std::ofstream file(path, std::ios::binary);
  if (file << data && file.flush()) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(path, ": can't be written"));
}

// Checks that a file can be written, before a long run whose result would be lost. Creates the file
// if there is none.
absl::Status CheckWritable(const std::string& path) {
  if (path.empty() || std::ofstream(path, std::ios::binary | std::ios::app)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(path, ": can't be written"));
}

std::vector<Point> PointsOf(const std::vector<std::string>& texts) {
  std::vector<Point> points;
  for (const std::string& text : texts) points.push_back(*ParsePoint(text));
  return points;
}

absl::Status Prepare(SimulateArguments& arguments) {
  robots::ExpeditionOptions& options = arguments.expedition;
  absl::StatusOr<Polygon> area = Polygon::Make(PointsOf(arguments.area));
  if (!area.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("--area: ", area.status().message()));
  }
  options.area = *std::move(area);
  options.starts = PointsOf(arguments.starts);
  if (!options.starts.empty() && options.starts.size() != static_cast<size_t>(options.robots)) {
    return absl::InvalidArgumentError(absl::StrCat("--start: ", options.starts.size(),
                                                   " positions for ", options.robots, " robots"));
  }
  absl::Status status = CheckWritable(arguments.ways_path);
  status.Update(CheckWritable(arguments.truth_path));
  options.noisy_detector = arguments.detector == "noisy";
  options.pose_error = arguments.pose == "amcl";
  options.explored_rule = *ParseCellRule(arguments.rule);
  return status;
}

absl::Status Run(SimulateArguments arguments, const Interruption& interruption) {
  HYPERMAP_RETURN_IF_ERROR(Prepare(arguments));
  const robots::ExpeditionOptions& options = arguments.expedition;
  HYPERMAP_ASSIGN_OR_RETURN(
      client::Client client,
      client::MakeClient(arguments.connection, {.retry_for = options.patience}));
  absl::StatusOr<robots::ExpeditionReport> report = absl::UnknownError("");
  {
    std::unique_ptr<ProgressLine> line;
    robots::TellProgress progress;
    if (isatty(STDERR_FILENO) != 0) {
      line = std::make_unique<ProgressLine>(std::cerr);
      progress = [&line](const robots::ExpeditionProgress& so_far) {
        line->Show(absl::StrCat(ProgressBar(so_far.fraction), "  ", so_far.steps, " steps, ",
                                so_far.goals, " goals reached"));
      };
    }
    report = robots::Explore(
        client, options, [&interruption] { return interruption.requested(); }, progress);
  }
  HYPERMAP_RETURN_IF_ERROR(report.status());
  std::cout << (arguments.json ? ReportJson(*report, options) + "\n" : ReportText(*report, options))
            << std::flush;
  absl::Status status = WriteFile(arguments.ways_path, WaysGeoJson(*report));
  status.Update(WriteFile(arguments.truth_path, report->truth));
  return status;
}

void AddMapOptions(CLI::App& command, SimulateArguments& a) {
  robots::ExpeditionOptions& options = a.expedition;
  client::AddConnectionFlags(command, a.connection);
  command.add_option("--map", options.map, "Name of the map")->required();
  command.add_option("--occupancy", options.occupancy_layer, "Occupancy layer with the walls")
      ->type_name("LAYER")
      ->capture_default_str();
  command
      .add_option("--objects", options.object_layers,
                  "Layers with the objects of the simulated world (default: all semantic layers "
                  "that no robot wrote)")
      ->type_name("LAYER")
      ->delimiter(',');
  command
      .add_option("--layer", options.semantic_layer,
                  "Semantic layer for the detected objects; created if there is none")
      ->capture_default_str();
  command
      .add_option("--explored", options.explored_layer,
                  "Layer in which observed floor is marked as explored; created if there is none")
      ->type_name("LAYER")
      ->capture_default_str();
  command
      .add_option("--area", a.area,
                  "Area to explore: the vertices of a polygon, in the map's frame")
      ->required()
      ->type_name("X,Y")
      ->check(IsPoint());
}

void AddRobotOptions(CLI::App& command, SimulateArguments& a) {
  robots::ExpeditionOptions& options = a.expedition;
  command.add_option("--robots", options.robots, "Number of robots")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command.add_option("--start", a.starts, "Start position of each robot (default: random)")
      ->type_name("X,Y")
      ->check(IsPoint());
  command.add_option("--name", options.name, "Name prefix; robots are called NAME-1, NAME-2, ...")
      ->capture_default_str();
  command.add_option("--radius", options.robot_radius_m, "Radius of a robot in metres")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
  command
      .add_option("--range", options.range_m,
                  "Range in metres within which robots observe the floor")
      ->check(CLI::Range(0.5, 8.0))
      ->capture_default_str();
  command.add_option("--detector", a.detector, "Detector: ideal, or noisy with errors")
      ->check(CLI::IsMember({"ideal", "noisy"}))
      ->capture_default_str();
  command.add_option("--pose", a.pose, "Poses: true, or amcl with errors like those of AMCL")
      ->check(CLI::IsMember({"true", "amcl"}))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Random seed")->capture_default_str();
}

void AddRunOptions(CLI::App& command, SimulateArguments& a) {
  robots::ExpeditionOptions& options = a.expedition;
  command.add_option("--rule", a.rule, "Rule for explored cells if the layer is created")
      ->check(CLI::IsMember({"centre", "covered", "touched"}))
      ->capture_default_str();
  command
      .add_option("--frame_every,--frame-every", options.frame_every,
                  "Send a frame every n-th step while driving")
      ->check(CLI::Range(1, 6))
      ->capture_default_str();
  command
      .add_option("--max_steps,--max-steps", options.max_steps,
                  "Fail after this many steps; 0 for no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--paths", a.ways_path, "Write the paths of the robots as GeoJSON")
      ->type_name("FILE");
  command
      .add_option("--truth", a.truth_path,
                  "Write the objects of the world, and how often each was seen, as GeoJSON for "
                  "hypermap eval --truth")
      ->type_name("FILE");
  command.add_flag("--json", a.json, "Print the summary as a line of JSON");
}

}  // namespace

void AddSimulateCommand(CLI::App& app, Command& selected) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command =
      app.add_subcommand("simulate", "Explore an area of a map with simulated robots");
  AddMapOptions(*command, *arguments);
  AddRobotOptions(*command, *arguments);
  AddRunOptions(*command, *arguments);
  command->callback([arguments, &selected] {
    selected = [arguments](const Interruption& interruption) {
      return Run(*arguments, interruption);
    };
  });
}

}  // namespace hypermap::ingest
