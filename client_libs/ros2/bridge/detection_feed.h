// Sends what a robot's detector finds in the images of a depth camera to an ingest worker
// (docs/ros2.md, Detections). A camera that a robot carries is a feed.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_DETECTION_FEED_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_DETECTION_FEED_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "client_libs/ros2/bridge/map_poses.h"
#include "client_libs/ros2/conversion/frames.h"
#include "client_libs/ros2/conversion/instances.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {

struct DetectionFeedOptions {
  std::string worker;    // HOST:PORT of `hypermap-ingest serve`
  std::string robot;     // whose frames they are to Hypermap
  std::string frame_id;  // what Hypermap calls the frame of the poses; empty: the map's own
  // Topics. One of `detections` (boxes) and `masks` (label images) is set.
  std::string depth;
  std::string camera_info;
  std::string detections;
  std::string masks;
  LabelImageOptions instances;  // of boxes, its labels alone
  // Whether images are rectified: matrix P and no distortion.
  bool is_rectified = false;
  // The optical frame of the camera. Empty: that of the depth images.
  std::string camera_frame;
  // The default is that of a localisation like AMCL's in an office.
  PoseSigma pose_sigma = {0.06, 0.06, 0.016};
  // Largest difference between the stamps of a depth image and its detections, and the number of
  // messages of a topic that wait for their partner.
  absl::Duration slop = absl::Milliseconds(20);
  int queue = 10;
  // How long a frame waits for its pose, and for the calibration.
  absl::Duration pose_patience = absl::Seconds(1);
  // See FrameSenderOptions.
  int64_t max_bytes = int64_t{256} << 20;
};

// Messages that can't be used are counted and logged. Images are converted on a thread of the feed,
// so that those of DDS do not wait.
class DetectionFeed {
 public:
  // `participant` and `poses` must outlive the result. UNAVAILABLE if DDS can't subscribe;
  // RESOURCE_EXHAUSTED if no thread can be started.
  static absl::StatusOr<std::unique_ptr<DetectionFeed>> Start(Participant* participant,
                                                              MapPoses* poses,
                                                              DetectionFeedOptions options);
  ~DetectionFeed();

 private:
  class Loop;
  explicit DetectionFeed(std::unique_ptr<Loop> loop);
  absl::Status Subscribe(Participant* participant, const DetectionFeedOptions& options);

  const std::unique_ptr<Loop> loop_;
  std::unique_ptr<Executor::Running> running_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_DETECTION_FEED_H_
