// Tells a server where a robot is.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_ROBOT_REPORTER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_ROBOT_REPORTER_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/sync/executor.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {

// A robot, and the topic of its poses.
struct RobotTopic {
  std::string robot;
  std::string topic;

  friend bool operator==(const RobotTopic&, const RobotTopic&) = default;
};

// Of "NAME=/TOPIC". INVALID_ARGUMENT.
absl::StatusOr<RobotTopic> ParseRobotTopic(absl::string_view text);

// Reports the newest pose of a topic, at most ten times a second. A pose that the server does not
// take is logged and forgotten; the next one is reported again.
class RobotReporter {
 public:
  // `participant` must outlive the result. UNAVAILABLE if DDS can't subscribe; RESOURCE_EXHAUSTED
  // if no thread can be started.
  static absl::StatusOr<std::unique_ptr<RobotReporter>> Start(Participant* participant,
                                                              client::Client client,
                                                              const std::string& map,
                                                              const RobotTopic& topic);
  ~RobotReporter();

 private:
  class Loop;
  explicit RobotReporter(std::unique_ptr<Loop> loop);

  const std::unique_ptr<Loop> loop_;
  std::unique_ptr<Executor::Running> running_;
  std::unique_ptr<Subscription> subscription_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_ROBOT_REPORTER_H_
