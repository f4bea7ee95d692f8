// The frames that /tf and /tf_static place, over the last seconds.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TRANSFORM_BUFFER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TRANSFORM_BUFFER_H_

#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/ros2/conversion/rigid_transform.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {

// Keeps ten seconds of each moving transform, and the newest of each static one. Times are those of
// the robots' clocks. A moving transform of a frame wins over a static one: a map may have a frame
// of the same name, which the bridge itself publishes.
//
// Names of frames have no slash at the beginning. Used by one thread at a time.
class TransformBuffer {
 public:
  // Whether the newest sample of a transform counts for 20 ms more. By then the next one should
  // have come; as long as it may still come, exact poses are worth waiting for.
  enum class AfterNewest { kNothing, kHolds };

  struct Stamped {
    RigidTransform transform;
    absl::Time stamp;
  };

  // Samples that are more than `max_gap` apart are not interpolated.
  explicit TransformBuffer(absl::Duration max_gap) : max_gap_(max_gap) {}

  // INVALID_ARGUMENT if the transform is not rigid, or of a frame to itself or without a name;
  // RESOURCE_EXHAUSTED if there are too many frames. A moving frame that gets another parent, or is
  // more than ten seconds older than before because the clock was set, begins anew.
  absl::Status Add(const geometry_msgs::TransformStamped& message, bool is_static);

  // Returns target_from_source at a time; each transform between them is interpolated by itself.
  // UNAVAILABLE if that may come to be known: the frames are not connected, or not up to this time.
  // OUT_OF_RANGE if it won't: there is a gap, or the time is before the first sample.
  absl::StatusOr<RigidTransform> At(const std::string& target, const std::string& source,
                                    absl::Time stamp, AfterNewest after_newest) const;

  // Returns target_from_source at the newest time of which all transforms between them are known.
  // UNAVAILABLE if the frames are not connected, or by static transforms alone, which tell nothing
  // of where a robot is.
  absl::StatusOr<Stamped> Newest(const std::string& target, const std::string& source) const;

 private:
  using Samples = std::map<absl::Time, RigidTransform>;
  struct Static {
    std::string parent;
    RigidTransform parent_from_frame;
  };
  struct Moving {
    std::string parent;
    Samples samples;  // of parent_from_frame; not empty
  };
  // Frames, each of which is placed in the next one; the last one in the nearest frame that source
  // and target have in common.
  using Chain = std::vector<std::string>;
  struct Path {
    Chain from_source;
    Chain from_target;
  };

  static void AddSample(const std::string& parent, absl::Time stamp, const RigidTransform& sample,
                        Moving* moving);
  // Null at a root.
  const std::string* ParentOf(const std::string& frame) const;
  // From the frame to its root. UNAVAILABLE if the transforms are a circle.
  absl::StatusOr<Chain> ChainFrom(const std::string& frame) const;
  absl::StatusOr<Path> PathBetween(const std::string& target, const std::string& source) const;
  absl::StatusOr<RigidTransform> Along(const Path& path, absl::Time stamp,
                                       AfterNewest after_newest) const;
  absl::StatusOr<RigidTransform> Compose(const Chain& chain, absl::Time stamp,
                                         AfterNewest after_newest) const;
  absl::StatusOr<RigidTransform> InParent(const std::string& frame, absl::Time stamp,
                                          AfterNewest after_newest) const;
  std::string KnownFrames() const;

  const absl::Duration max_gap_;
  std::map<std::string, Static> static_;
  std::map<std::string, Moving> moving_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TRANSFORM_BUFFER_H_
