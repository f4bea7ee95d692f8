// Tells a server where a robot is.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_ROBOT_REPORTER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_ROBOT_REPORTER_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/sync/executor.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/bridge/map_poses.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {

// A robot, and where its poses come from: a topic, or a frame of tf.
struct RobotSource {
  std::string robot;
  std::string topic;  // empty: by the frame
  std::string frame;

  friend bool operator==(const RobotSource&, const RobotSource&) = default;
};

// Of "NAME=/TOPIC" or "NAME=tf:FRAME". INVALID_ARGUMENT.
absl::StatusOr<RobotSource> ParseRobotSource(absl::string_view text);

// Reports the newest pose of a robot, at most ten times a second. A pose that the server does not
// take is logged and forgotten; the next one is reported again.
class RobotReporter {
 public:
  // Reports the poses of a topic. `participant` must outlive the result. UNAVAILABLE if DDS can't
  // subscribe; RESOURCE_EXHAUSTED if no thread can be started.
  static absl::StatusOr<std::unique_ptr<RobotReporter>> OfTopic(Participant* participant,
                                                                client::Client client,
                                                                const std::string& map,
                                                                const RobotSource& source);
  // Reports the poses of a frame of tf. `frame_id` is what Hypermap calls their frame; empty: the
  // map's own. `poses` must outlive the result. RESOURCE_EXHAUSTED as above.
  static absl::StatusOr<std::unique_ptr<RobotReporter>> OfFrame(MapPoses* poses,
                                                                const std::string& frame_id,
                                                                client::Client client,
                                                                const std::string& map,
                                                                const RobotSource& source);
  ~RobotReporter();

 private:
  class Loop;
  explicit RobotReporter(std::unique_ptr<Loop> loop);
  absl::Status Run();

  const std::unique_ptr<Loop> loop_;
  std::unique_ptr<Executor::Running> running_;
  std::unique_ptr<Subscription> subscription_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_ROBOT_REPORTER_H_
