#include "ingest/worker/replay_command.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "ingest/perception/pose_sigma.h"
#include "ingest/sources/occupancy_file.h"
#include "ingest/worker/progress_line.h"
#include "ingest/worker/replay.h"
#include "ingest/worker/summary_output.h"
#include "ingest/worker/target_options.h"

namespace hypermap::ingest {
namespace {

namespace fs = std::filesystem;

// The arguments of the command line.
struct ReplayArguments {
  ReplayOptions replay;
  std::string pose_sigma;
  std::string segmenter = "organised";
  std::string occupancy;
  double max_association_s = 0.02;
  double max_pose_gap_s = 0.5;
  int threads = 0;
  bool json = false;
};

// Returns the last component of a path: "office_small" for "data/office_small/".
std::string NameOfFolder(const std::string& folder) {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(folder, error);
  return error ? folder : path.filename().string();
}

absl::Status SetOccupancy(const std::string& argument, ReplayOptions& options) {
  if (argument == "none") return absl::OkStatus();
  std::error_code error;
  fs::path path = fs::path(options.folder) / (argument.empty() ? "occupancy.yaml" : argument);
  if (!fs::exists(path, error)) {
    if (argument.empty()) return absl::OkStatus();
    if (fs::exists(argument, error)) path = argument;
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::shared_ptr<const GridLayer> layer, ReadOccupancy(path.string()));
  options.occupancy = std::move(layer);
  return absl::OkStatus();
}

// Returns an error for an interrupted run, and for one of whose frames the server has none:
// probably the poses, the detections or the server's layer are the wrong ones.
absl::Status Judge(const ReplaySummary& summary) {
  if (summary.interrupted) {
    return absl::CancelledError("interrupted; run the same command again to resume");
  }
  const int64_t taken = summary.accepted + summary.duplicates + summary.known;
  if (taken > 0 || summary.frames == 0) return absl::OkStatus();
  const auto most =
      std::max_element(summary.skipped_frames.begin(), summary.skipped_frames.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return absl::FailedPreconditionError(
      absl::StrCat("no frame could be used: ",
                   most != summary.skipped_frames.end() ? most->first : summary.first_refusal));
}

absl::Status Run(ReplayArguments arguments, const Interruption& interruption) {
  ReplayOptions& options = arguments.replay;
  if (options.dataset.robot.empty()) options.dataset.robot = NameOfFolder(options.folder);
  if (!arguments.pose_sigma.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(options.dataset.pose_sigma, ParsePoseSigma(arguments.pose_sigma));
  }
  options.dataset.max_association = absl::Seconds(arguments.max_association_s);
  options.dataset.max_pose_gap = absl::Seconds(arguments.max_pose_gap_s);
  options.target.frame_id = options.dataset.frame_id;
  options.threads = arguments.threads > 0
                        ? arguments.threads
                        : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  options.make_segmenter = [&] { return MakeSegmenter(arguments.segmenter); };
  HYPERMAP_RETURN_IF_ERROR(SetOccupancy(arguments.occupancy, options));

  absl::StatusOr<ReplaySummary> summary = absl::UnknownError("");
  {
    std::unique_ptr<ProgressLine> line;
    ReplayProgress progress;
    if (isatty(STDERR_FILENO) != 0) {
      line = std::make_unique<ProgressLine>(std::cerr);
      progress = [&line](const ReplaySummary& so_far) { line->Show(ProgressText(so_far)); };
    }
    summary = Replay(options, interruption, progress);
  }
  HYPERMAP_RETURN_IF_ERROR(summary.status());
  std::cout << (arguments.json ? SummaryJson(*summary, options.target) + "\n"
                               : SummaryText(*summary, options.target))
            << std::flush;
  return Judge(*summary);
}

void AddSourceOptions(CLI::App& command, ReplayArguments& a) {
  RgbdOptions& dataset = a.replay.dataset;
  dataset.robot.clear();
  command
      .add_option("DIR", a.replay.folder,
                  "Folder with the recording, in the layout of the TUM RGB-D dataset")
      ->required();
  command
      .add_option("--detections", dataset.detections,
                  "Detections as COCO results; a path in DIR or elsewhere")
      ->type_name("FILE")
      ->capture_default_str();
  command
      .add_option("--images", dataset.images,
                  "COCO file with the images and categories, if --detections is a list of results")
      ->type_name("FILE");
  command
      .add_option("--poses", dataset.poses, "Trajectory of the camera; a path in DIR or elsewhere")
      ->type_name("FILE")
      ->capture_default_str();
  command.add_option("--robot", dataset.robot, "Name of the robot (default: the name of DIR)");
  command.add_option("--frame_id", dataset.frame_id, "Frame of the poses (default: the map's)");
  command
      .add_option("--pose_sigma", a.pose_sigma,
                  "Standard deviations of the poses in m and rad (default: those in a comment "
                  "`# pose_sigma: X,Y,YAW` of the trajectory, else " +
                      FormatPoseSigma(kMotionCaptureSigma) + " for groundtruth.txt and " +
                      FormatPoseSigma(kLocalisationSigma) + " for other files)")
      ->check(IsPoseSigma());
  command
      .add_option("--max_association", a.max_association_s,
                  "Maximum seconds between a depth image and its detections")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      .add_option("--max_pose_gap", a.max_pose_gap_s,
                  "Maximum seconds between poses to interpolate")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
}

void AddRunOptions(CLI::App& command, ReplayArguments& a) {
  AddSegmenterOption(command, a.segmenter);
  command
      .add_option("--occupancy", a.occupancy,
                  "nav2 YAML file of the map with which poses are refined, or none (default: "
                  "DIR/occupancy.yaml if it exists)")
      ->type_name("FILE");
  command
      .add_option("--rate", a.replay.rate,
                  "Speed relative to the recording: 1 for real time, 0 for no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--first", a.replay.first, "Index of the first depth image")
      ->capture_default_str();
  command.add_option("--end", a.replay.end, "Index of the depth image to stop before");
  command.add_option("--stride", a.replay.stride, "Use every n-th depth image")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option("--threads", a.threads,
                  "Number of threads that process frames; 0 for one per core")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag(
      "--smooth", a.replay.smooth,
      "Smooth the poses of the layer when all frames are sent (see the command smooth)");
  command.add_flag("--json", a.json, "Print the summary as JSON");
}

}  // namespace

void AddReplayCommand(CLI::App& app, Command& selected) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand("replay", "Send a recorded drive to a server");
  AddSourceOptions(*command, *arguments);
  AddTargetOptions(*command, arguments->replay.target);
  AddRunOptions(*command, *arguments);
  command->callback([arguments, &selected] {
    selected = [arguments](const Interruption& interruption) {
      return Run(*arguments, interruption);
    };
  });
}

}  // namespace hypermap::ingest
