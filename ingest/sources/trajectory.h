// Where a camera was over time.
#ifndef HYPERMAP_INGEST_SOURCES_TRAJECTORY_H_
#define HYPERMAP_INGEST_SOURCES_TRAJECTORY_H_

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace hypermap::ingest {

struct TrajectoryLimits {
  // A pose is interpolated between samples not farther apart than this.
  absl::Duration max_gap = absl::Seconds(0.5);
  // Before the first and after the last sample, theirs is taken for this long.
  absl::Duration max_beyond = absl::Seconds(0.02);
};

// Immutable; safe to use from many threads.
class Trajectory {
 public:
  // TUM's format: lines `t tx ty tz qx qy qz qw`, in any order. A line that can't be understood, or
  // whose numbers are no pose (not finite; a quaternion whose length is not 1 to within 1 %), is
  // counted, and where its stamp can be read nothing is interpolated across it. Of several lines
  // with one stamp the last counts. INVALID_ARGUMENT when no line is a pose.
  static absl::StatusOr<Trajectory> Parse(absl::string_view text);

  // Linear in position, slerp in rotation. NOT_FOUND with the reason when there is none.
  absl::StatusOr<Eigen::Isometry3d> At(absl::Time stamp, const TrajectoryLimits& limits) const;

  int bad_lines() const { return bad_lines_; }

 private:
  struct Sample {
    absl::Time stamp;
    bool valid = false;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  };

  std::vector<Sample> samples_;  // ascending
  int bad_lines_ = 0;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_TRAJECTORY_H_
