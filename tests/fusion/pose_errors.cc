// Tells the errors of a recorded drive's poses: as the trajectory has them, as perception matches
// them to the occupancy grid, and as smoothing leaves them, without and with the grid's walls.
//
//   pose_errors DRIVE [--poses=estimated.txt]
//
// Each line is a JSON object with the root mean square errors along x and y and of the yaw, and
// what is left of the first two if the whole trajectory is placed as well as it can be (Umeyama
// 1991). The drive has groundtruth.txt and occupancy.yaml.
#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "ingest/perception/observer.h"
#include "ingest/sources/occupancy_file.h"
#include "ingest/sources/rgbd_dataset.h"
#include "map/observations/pose_correction.h"
#include "map/observations/view_frame.h"
#include "map/smoothing/pose_smoother.h"

namespace hypermap::ingest {
namespace {

using Poses = std::vector<PlanarTransform>;

Eigen::Matrix2Xd Places(const Poses& poses) {
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(poses.size()));
  for (Eigen::Index i = 0; i < places.cols(); ++i) places.col(i) << poses[i].x(), poses[i].y();
  return places;
}

void Print(const std::string& name, const Poses& poses, const Poses& truth) {
  const Eigen::Matrix2Xd places = Places(poses);
  const Eigen::Matrix2Xd errors = places - Places(truth);
  double yaw = 0.0;
  for (size_t i = 0; i < poses.size(); ++i) {
    yaw += std::pow(std::remainder(poses[i].yaw() - truth[i].yaw(), 2.0 * M_PI), 2);
  }
  const Eigen::Matrix3d placed = Eigen::umeyama(places, Places(truth), /*with_scaling=*/false);
  const Eigen::Matrix2Xd rest =
      ((placed.topLeftCorner<2, 2>() * places).colwise() + placed.topRightCorner<2, 1>()) -
      Places(truth);
  const double n = static_cast<double>(poses.size());
  const Eigen::Vector2d rms = (errors.rowwise().squaredNorm() / n).cwiseSqrt();
  std::cout << absl::StreamFormat(
                   R"({"poses":"%s","x_m":%.4f,"y_m":%.4f,"yaw_deg":%.3f,"placed_m":%.4f})", name,
                   rms.x(), rms.y(), std::sqrt(yaw / n) * 180.0 / M_PI,
                   std::sqrt(rest.squaredNorm() / n))
            << std::endl;
}

absl::Status PrintSmoothed(const std::string& name, const std::vector<smoothing::View>& views,
                           const smoothing::GridWalls* walls, const Poses& truth) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<CorrectedPose> smoothed,
                            smoothing::SmoothPoses(views, walls));
  Poses poses;
  for (const CorrectedPose& pose : smoothed) poses.push_back(pose.frame_from_view);
  Print(name, poses, truth);
  return absl::OkStatus();
}

absl::Status Run(const std::string& drive, const std::string& trajectory) {
  RgbdOptions options;
  options.robot = "robot";
  options.poses = trajectory;
  options.detections = "detections_noisy.json";  // They are left out, but must be there.
  HYPERMAP_ASSIGN_OR_RETURN(const auto claimed, RgbdDataset::Open(drive, options));
  options.poses = "groundtruth.txt";
  HYPERMAP_ASSIGN_OR_RETURN(const auto true_drive, RgbdDataset::Open(drive, options));
  HYPERMAP_ASSIGN_OR_RETURN(const auto occupancy, ReadOccupancy(drive + "/occupancy.yaml"));
  const Observer observer(MakeOrganisedSegmenter(), occupancy, ObserverOptions());
  Poses claims, matched, truth;
  std::vector<smoothing::View> views;
  SkipCounts skipped;
  for (size_t i = 0; i < claimed->size(); ++i) {
    absl::StatusOr<Frame> frame = claimed->Load(i, skipped);
    const absl::StatusOr<Frame> true_frame = true_drive->Load(i, skipped);
    if (!frame.ok() || !true_frame.ok()) continue;
    frame->instances.clear();
    HYPERMAP_ASSIGN_OR_RETURN(const Observation observation, observer.Observe(*frame, nullptr));
    claims.push_back(ViewPose(frame->frame_from_camera));
    matched.push_back(*observation.frame_from_view);
    truth.push_back(ViewPose(true_frame->frame_from_camera));
    views.push_back({"robot",
                     {observation.stamp, claims.back(), frame->pose_covariance},
                     smoothing::DepthScan(observation)});
  }
  if (views.empty()) return absl::NotFoundError("the drive has no frames with poses");
  Print("claimed", claims, truth);
  Print("matched", matched, truth);
  HYPERMAP_RETURN_IF_ERROR(PrintSmoothed("smoothed", views, nullptr, truth));
  const smoothing::GridWalls walls(*occupancy, PlanarTransform());
  return PrintSmoothed("smoothed with walls", views, &walls, truth);
}

}  // namespace
}  // namespace hypermap::ingest

int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  CLI::App app("Tells the errors of a recorded drive's poses before and after smoothing");
  std::string drive, trajectory = "estimated.txt";
  app.add_option("drive", drive, "Folder of the drive")->required();
  app.add_option("--poses", trajectory, "Trajectory with the claimed poses")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = hypermap::ingest::Run(drive, trajectory);
  if (status.ok()) return 0;
  std::cerr << status.message() << "\n";
  return 1;
}
