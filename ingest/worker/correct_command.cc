#include "ingest/worker/correct_command.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/flags/connection_flags.h"
#include "ingest/perception/pose_sigma.h"
#include "ingest/sources/input_file.h"
#include "ingest/sources/trajectory.h"
#include "ingest/worker/target_options.h"
#include "map/observations/pose_correction.h"

namespace hypermap::ingest {
namespace {

// Poses of a call, which make a message of about 1 MB. A trajectory that has more is sent in parts
// that have their ends in common, so that poses between them are interpolated.
constexpr size_t kPosesPerCall = 10'000;

// The arguments of the command line.
struct CorrectArguments {
  client::ConnectionFlags connection;
  std::string map;
  std::string layer = "semantic";
  std::string trajectory;
  std::string robot;
  std::string frame_id;
  std::string pose_sigma;
};

absl::StatusOr<PoseCorrection> ReadCorrection(const CorrectArguments& arguments) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadFile(arguments.trajectory));
  HYPERMAP_ASSIGN_OR_RETURN(const Trajectory trajectory, Trajectory::Parse(text));
  if (trajectory.bad_lines() > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(arguments.trajectory, ": ", trajectory.bad_lines(), " lines are no pose"));
  }
  PoseSigma sigma;
  if (!arguments.pose_sigma.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(sigma, ParsePoseSigma(arguments.pose_sigma));
  } else {
    sigma = SigmaOf(trajectory, arguments.trajectory);
  }
  return PoseCorrection{arguments.robot, trajectory.ViewPoses(sigma.Covariance())};
}

absl::Status Run(const CorrectArguments& arguments, const Interruption& interruption) {
  HYPERMAP_ASSIGN_OR_RETURN(const PoseCorrection correction, ReadCorrection(arguments));
  HYPERMAP_ASSIGN_OR_RETURN(client::Client client,
                            client::MakeClient(arguments.connection, client::ClientOptions()));
  const std::vector<CorrectedPose>& poses = correction.poses;
  std::optional<Revision> revision;
  // The newest first: each part costs the fold of everything after it.
  size_t end = poses.size();
  while (end > 0) {
    if (interruption.requested()) return absl::CancelledError("interrupted");
    const size_t begin = end - std::min(end, kPosesPerCall);
    const absl::StatusOr<Revision> corrected = client.CorrectPoses(
        arguments.map, arguments.layer,
        {correction.robot, {poses.begin() + begin, poses.begin() + end}}, arguments.frame_id);
    if (corrected.ok()) {
      revision = *corrected;
    } else if (!absl::IsNotFound(corrected.status()) || (begin == 0 && !revision)) {
      return corrected.status();
    }
    end = begin == 0 ? 0 : begin + 1;
  }
  std::cout << arguments.map << ": poses of " << arguments.robot << " corrected in "
            << arguments.layer << ", revision " << *revision << "\n";
  return absl::OkStatus();
}

}  // namespace

void AddCorrectCommand(CLI::App& app, Command& selected) {
  auto arguments = std::make_shared<CorrectArguments>();
  CorrectArguments& a = *arguments;
  CLI::App* command = app.add_subcommand(
      "correct", "Give a robot's observations the poses that were found out later");
  command->add_option("TRAJECTORY", a.trajectory, "Poses of the camera, in TUM's format")
      ->required();
  client::AddConnectionFlags(*command, a.connection);
  command->add_option("--map", a.map, "Name of the map")->required();
  command->add_option("--layer", a.layer, "Fused layer")->capture_default_str();
  command->add_option("--robot", a.robot, "Name of the robot")->required();
  command->add_option("--frame_id", a.frame_id, "Frame of the poses (default: the map's)");
  command
      ->add_option("--pose_sigma", a.pose_sigma,
                   "Standard deviations of the poses in m and rad (default: those in a comment "
                   "`# pose_sigma: X,Y,YAW` of the trajectory, else " +
                       FormatPoseSigma(kMotionCaptureSigma) + " for groundtruth.txt and " +
                       FormatPoseSigma(kLocalisationSigma) + " for other files)")
      ->check(IsPoseSigma());
  command->callback([arguments, &selected] {
    selected = [arguments](const Interruption& interruption) {
      return Run(*arguments, interruption);
    };
  });
}

}  // namespace hypermap::ingest
