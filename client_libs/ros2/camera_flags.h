// The flags of hypermap-ros2 for the detections of a camera.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CAMERA_FLAGS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CAMERA_FLAGS_H_

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/ros2/bridge/detection_feed.h"

namespace hypermap::ros2 {

// The values of the flags.
struct CameraFlags {
  DetectionFeedOptions feed;
  std::string labels;  // a file
  std::vector<double> pose_sigma = {0.06, 0.06, 0.016};
  double slop_seconds = 0.02;
  int64_t queue_mib = 256;

  // Whether detections are sent at all.
  bool is_set() const { return !feed.worker.empty(); }
};

// `flags` must outlive the parser.
void AddCameraFlags(CLI::App& app, CameraFlags& flags);

// REQUIRES: is_set(). `max_pose_gap`: the largest time between samples of tf that are interpolated.
// INVALID_ARGUMENT if flags do not belong together or the file has no labels; NOT_FOUND if it can't
// be read.
absl::StatusOr<DetectionFeedOptions> FeedOptionsOf(const CameraFlags& flags,
                                                   absl::Duration max_pose_gap);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CAMERA_FLAGS_H_
