// The poses of a camera over time.
#ifndef HYPERMAP_INGEST_SOURCES_TRAJECTORY_H_
#define HYPERMAP_INGEST_SOURCES_TRAJECTORY_H_

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "ingest/perception/pose_sigma.h"
#include "map/observations/pose_correction.h"

namespace hypermap::ingest {

struct TrajectoryLimits {
  // Poses are interpolated between samples that are at most this far apart.
  absl::Duration max_gap = absl::Seconds(0.5);
  // For this long before the first sample and after the last one, that sample's pose is returned.
  absl::Duration max_beyond = absl::Seconds(0.02);
};

// Immutable; safe to use from many threads.
class Trajectory {
 public:
  // Parses TUM's format: lines `t tx ty tz qx qy qz qw`, in any order. Lines that can't be parsed,
  // or whose numbers are no pose (not finite, or a quaternion whose length differs from 1 by 1 % or
  // more), are counted as bad. No pose is interpolated across the stamp of a bad line, if the stamp
  // can be read. The last of several lines with one stamp counts. A comment line `# pose_sigma:
  // X,Y,YAW` states the standard deviations of the poses; the last one counts. Returns
  // INVALID_ARGUMENT if no line is a pose, or if such a comment can't be parsed.
  static absl::StatusOr<Trajectory> Parse(absl::string_view text);

  // Returns the pose at `stamp`, interpolated linearly in position and by slerp in rotation.
  // Returns NOT_FOUND, with the reason, if the stamp is outside the trajectory, in a gap, or at or
  // next to a bad line.
  absl::StatusOr<Eigen::Isometry3d> At(absl::Time stamp, const TrajectoryLimits& limits) const;

  struct Pose {
    absl::Time stamp;
    Eigen::Isometry3d pose;
  };
  // The poses of all good lines, ascending by stamp.
  std::vector<Pose> Poses() const;
  // The poses of the views (RoundedViewPose) at these stamps and, as At has it with
  // default limits, at max_beyond before the first and after the last. PoseAt() interpolates them.
  std::vector<CorrectedPose> ViewPoses(const Eigen::Matrix3d& covariance) const;

  int bad_lines() const { return bad_lines_; }
  // Nullopt if the file does not state it.
  const std::optional<PoseSigma>& pose_sigma() const { return pose_sigma_; }

 private:
  struct Sample {
    absl::Time stamp;
    bool valid = false;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  };

  // Ascending by stamp. Bad lines stay as samples that are not valid, so that the time around them
  // is not mistaken for a gap that may be bridged.
  std::vector<Sample> samples_;
  int bad_lines_ = 0;
  std::optional<PoseSigma> pose_sigma_;
};

// Returns the standard deviations of a trajectory's poses: those that the file states. TUM's files
// state none, and then the file's name decides: kMotionCaptureSigma for groundtruth.txt, otherwise
// kLocalisationSigma.
PoseSigma SigmaOf(const Trajectory& trajectory, const std::string& file);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_TRAJECTORY_H_
