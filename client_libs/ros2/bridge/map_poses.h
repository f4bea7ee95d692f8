// Poses of robots' frames in the frame of a map, by /tf and /tf_static.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_MAP_POSES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_MAP_POSES_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/bridge/problem_log.h"
#include "client_libs/ros2/bridge/transform_buffer.h"
#include "client_libs/ros2/conversion/rigid_transform.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {

struct MapPosesOptions {
  std::string tf = "/tf";
  std::string tf_static = "/tf_static";
  // The name of the map's frame in ROS. It is asked for when it is needed first, and again while
  // there is an error, at most once a second.
  std::function<absl::StatusOr<std::string>()> find_map_frame;
  // Samples that are more than this apart are not interpolated.
  absl::Duration max_gap = absl::Milliseconds(500);
};

// Thread safe.
class MapPoses {
 public:
  // `participant` must outlive the result. UNAVAILABLE if DDS can't subscribe.
  static absl::StatusOr<std::unique_ptr<MapPoses>> Start(Participant* participant,
                                                         MapPosesOptions options);

  // See TransformBuffer. Also the errors of find_map_frame, as UNAVAILABLE.
  absl::StatusOr<RigidTransform> At(const std::string& frame, absl::Time stamp,
                                    TransformBuffer::AfterNewest after_newest);
  absl::StatusOr<TransformBuffer::Stamped> Newest(const std::string& frame);

 private:
  explicit MapPoses(MapPosesOptions options);
  void Take(absl::string_view message, bool is_static);
  absl::StatusOr<std::string> MapFrame();

  const MapPosesOptions options_;
  ProblemLog problems_;
  Mutex asking_;  // Held while the map's frame is asked for.
  absl::StatusOr<std::string> map_frame_ ABSL_GUARDED_BY(asking_);
  SteadyTime asked_ ABSL_GUARDED_BY(asking_) = SteadyTime::InfinitePast();
  Mutex mutex_;
  TransformBuffer buffer_ ABSL_GUARDED_BY(mutex_);
  // Last, so that no message comes when the others have gone.
  std::unique_ptr<Subscription> moving_;
  std::unique_ptr<Subscription> static_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_MAP_POSES_H_
