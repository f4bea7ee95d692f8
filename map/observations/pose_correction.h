// What is known later about a robot's poses, for instance by SLAM that has closed a loop.
#ifndef HYPERMAP_MAP_OBSERVATIONS_POSE_CORRECTION_H_
#define HYPERMAP_MAP_OBSERVATIONS_POSE_CORRECTION_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/frames/planar_transform.h"
#include "map/observations/observation.h"

namespace hypermap {

// Where a robot's camera was at a time.
struct CorrectedPose {
  absl::Time stamp;
  PlanarTransform frame_from_view;  // As ViewPose (view_frame.h).
  // Covariance of (x, y, yaw), in m and rad. Zero: exact.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// Replaces the poses of a robot's observations. Their heights, roll and pitch stay.
struct PoseCorrection {
  std::string robot;
  std::vector<CorrectedPose> poses;  // Ascending by stamp, no two of one stamp.
  // Whether the poses were computed from the observations (map/smoothing), rather than told by the
  // robot: the next computation begins without them.
  bool is_smoothed = false;
};

// Bounds the memory of a correction: 14 hours at 2 Hz.
inline constexpr size_t kMaxCorrectedPoses = 100'000;
// Longest time between two poses over which they are interpolated.
inline constexpr absl::Duration kMaxPoseGap = absl::Milliseconds(500);

// Returns INVALID_ARGUMENT naming the field ("poses[3].covariance ...").
absl::Status Validate(const PoseCorrection& correction);

// Returns the correction in another frame.
PoseCorrection Transformed(const PoseCorrection& correction,
                           const PlanarTransform& target_from_source);

// The pose at a time; interpolated (yaw the shorter way round, and the covariance) between poses
// that are at most kMaxPoseGap apart. nullopt before the first, after the last, and in a gap.
std::optional<CorrectedPose> PoseAt(absl::Span<const CorrectedPose> poses, absl::Time stamp);

// Returns the observation, with all coordinates in its frame, as if the camera had had this pose.
// One that is relative to its view is then equal, to the last bit, to Placed() of the one that was
// sent with this pose. nullopt if it would not be CanBeStored.
std::optional<Observation> WithPose(const Observation& observation, const CorrectedPose& pose);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_POSE_CORRECTION_H_
