#include "client_libs/ros2/camera_flags.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/conversion/labels.h"

namespace hypermap::ros2 {
namespace {

// As for hypermap-bag and hypermap-ingest.
constexpr double kMaxSigma = 1000.0;

absl::StatusOr<Labels> ReadLabels(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return absl::NotFoundError(absl::StrCat(path, " can't be read"));
  absl::StatusOr<Labels> labels = ParseLabels(text.str());
  if (labels.ok()) return labels;
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", labels.status().message()));
}

void AddTopicFlags(CLI::App& app, CLI::Option* ingest, DetectionFeedOptions& feed) {
  CLI::Option* const depth =
      app.add_option("--depth", feed.depth,
                     "Topic of depth images: sensor_msgs/msg/Image, 16UC1 (or mono16) in "
                     "millimetres, or 32FC1 in metres")
          ->type_name("TOPIC")
          ->needs(ingest);
  CLI::Option* const camera_info =
      app.add_option("--camera_info", feed.camera_info,
                     "Topic of the sensor_msgs/msg/CameraInfo of the depth images")
          ->type_name("TOPIC")
          ->needs(ingest);
  CLI::Option* const robot =
      app.add_option("--camera_robot", feed.robot,
                     "Name of the robot, or of its camera, whose frames they are")
          ->type_name("NAME")
          ->needs(ingest);
  ingest->needs(depth)->needs(camera_info)->needs(robot);
}

void AddInstanceFlags(CLI::App& app, CLI::Option* ingest, CameraFlags& flags) {
  DetectionFeedOptions& feed = flags.feed;
  CLI::Option* const labels =
      app.add_option("--labels", flags.labels,
                     "File with the label of each class id or number, such as `56: chair`; what it "
                     "does not name is left out of masks, and keeps its id in detections")
          ->type_name("FILE")
          ->needs(ingest);
  CLI::Option* const detections =
      app.add_option("--detections", feed.detections,
                     "Topic of vision_msgs/msg/Detection2DArray, boxes in the depth image")
          ->type_name("TOPIC")
          ->needs(ingest);
  app.add_option("--masks", feed.masks,
                 "Topic of sensor_msgs/msg/Image with a number for each pixel of the depth image: "
                 "mono8, 8UC1, mono16, 16UC1 or 32SC1")
      ->type_name("TOPIC")
      ->needs(ingest)
      ->needs(labels)
      ->excludes(detections);
  app.add_option("--label_divisor", feed.instances.divisor,
                 "Masks have class * N + instance; 0: they have the class, and each connected "
                 "region is an instance")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->needs(ingest)
      ->capture_default_str();
  app.add_option("--score", feed.instances.score, "Score of masks, in (0, 1]")
      ->check(CLI::Range(1e-9, 1.0))
      ->needs(ingest)
      ->capture_default_str();
}

}  // namespace

void AddCameraFlags(CLI::App& app, CameraFlags& flags) {
  DetectionFeedOptions& feed = flags.feed;
  CLI::Option* const ingest =
      app.add_option("--ingest", feed.worker,
                     "Address of `hypermap-ingest serve`, to which the detections of a camera are "
                     "sent")
          ->type_name("HOST:PORT");
  AddTopicFlags(app, ingest, feed);
  AddInstanceFlags(app, ingest, flags);
  app.add_flag("--rectified", feed.is_rectified,
               "The images are rectified: use matrix P and no distortion")
      ->needs(ingest);
  app.add_option("--camera_frame", feed.camera_frame,
                 "Optical frame of the depth camera (default: that of the depth images)")
      ->type_name("FRAME")
      ->needs(ingest);
  app.add_option("--pose_sigma", flags.pose_sigma,
                 "Standard deviations of the camera's poses, in m, m and rad")
      ->type_name("X,Y,YAW")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0.0, kMaxSigma))
      ->needs(ingest)
      ->capture_default_str();
  app.add_option("--slop_seconds", flags.slop_seconds,
                 "Largest difference between the stamps of a depth image and its detections")
      ->check(CLI::Range(0.0, 1e6))
      ->needs(ingest)
      ->capture_default_str();
  app.add_option("--queue", feed.queue, "Messages of a topic that wait for their partner")
      ->check(CLI::Range(1, 1000))
      ->needs(ingest)
      ->capture_default_str();
  app.add_option("--frame_queue_mib", flags.queue_mib,
                 "Most memory, in MiB, of frames that the worker has not acknowledged; the oldest "
                 "are dropped")
      ->check(CLI::Range(1, 1 << 20))
      ->needs(ingest)
      ->capture_default_str();
}

absl::StatusOr<DetectionFeedOptions> FeedOptionsOf(const CameraFlags& flags,
                                                   absl::Duration max_pose_gap) {
  DetectionFeedOptions feed = flags.feed;
  if (feed.detections.empty() && feed.masks.empty()) {
    return absl::InvalidArgumentError("--ingest needs --detections or --masks");
  }
  if (!flags.labels.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(feed.instances.labels, ReadLabels(flags.labels));
  }
  std::copy_n(flags.pose_sigma.begin(), feed.pose_sigma.size(), feed.pose_sigma.begin());
  feed.slop = absl::Seconds(flags.slop_seconds);
  // The next sample may come that much later, and takes its time.
  feed.pose_patience += max_pose_gap;
  feed.max_bytes = flags.queue_mib << 20;
  return feed;
}

}  // namespace hypermap::ros2
