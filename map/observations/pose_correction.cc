#include "map/observations/pose_correction.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/frames/pose_covariance.h"
#include "map/observations/view_frame.h"

namespace hypermap {
namespace {

CorrectedPose Between(const CorrectedPose& a, const CorrectedPose& b, absl::Time stamp) {
  const double share = absl::FDivDuration(stamp - a.stamp, b.stamp - a.stamp);
  const PlanarTransform& from = a.frame_from_view;
  const PlanarTransform& to = b.frame_from_view;
  const double turn = std::remainder(to.yaw() - from.yaw(), 2.0 * M_PI);
  return {stamp,
          PlanarTransform(from.x() + share * (to.x() - from.x()),
                          from.y() + share * (to.y() - from.y()), from.yaw() + share * turn),
          (1.0 - share) * a.covariance + share * b.covariance};
}

}  // namespace

absl::Status Validate(const PoseCorrection& correction) {
  HYPERMAP_RETURN_IF_ERROR(ValidateRobotName(correction.robot));
  if (correction.poses.empty()) return absl::InvalidArgumentError("poses are empty");
  if (correction.poses.size() > kMaxCorrectedPoses) {
    return absl::InvalidArgumentError(absl::StrCat("poses are more than ", kMaxCorrectedPoses));
  }
  for (size_t i = 0; i < correction.poses.size(); ++i) {
    const CorrectedPose& pose = correction.poses[i];
    const std::string field = absl::StrCat("poses[", i, "]");
    HYPERMAP_RETURN_IF_ERROR(CheckTranslation(field + ".pose", pose.frame_from_view));
    if (!IsPoseCovariance(pose.covariance)) {
      return absl::InvalidArgumentError(
          absl::StrCat(field, ".covariance must be finite, symmetric and not negative"));
    }
    if (i > 0 && pose.stamp <= correction.poses[i - 1].stamp) {
      return absl::InvalidArgumentError(
          absl::StrCat(field, ".stamp does not follow that of the pose before it"));
    }
  }
  return absl::OkStatus();
}

PoseCorrection Transformed(const PoseCorrection& correction,
                           const PlanarTransform& target_from_source) {
  PoseCorrection moved = correction;
  if (target_from_source.IsIdentity()) return moved;
  for (CorrectedPose& pose : moved.poses) {
    pose.frame_from_view = target_from_source * pose.frame_from_view;
    pose.covariance = TransformedCovariance(pose.covariance, target_from_source);
  }
  return moved;
}

std::optional<CorrectedPose> PoseAt(absl::Span<const CorrectedPose> poses, absl::Time stamp) {
  const auto after = std::lower_bound(
      poses.begin(), poses.end(), stamp,
      [](const CorrectedPose& pose, absl::Time time) { return pose.stamp < time; });
  if (after == poses.end()) return std::nullopt;
  if (after->stamp == stamp) return *after;
  if (after == poses.begin()) return std::nullopt;
  const CorrectedPose& before = *(after - 1);
  if (after->stamp - before.stamp > kMaxPoseGap) return std::nullopt;
  return Between(before, *after, stamp);
}

std::optional<Observation> WithPose(const Observation& observation, const CorrectedPose& pose) {
  Observation moved = observation;
  if (moved.frame_from_view) {
    moved.frame_from_view = pose.frame_from_view;
    moved = Placed(moved);
  } else {
    const PlanarTransform claimed = ViewPose(observation.pose.frame_from_camera);
    moved =
        Transformed(observation, pose.frame_from_view * claimed.Inverse(), observation.frame_id);
  }
  moved.pose.covariance = pose.covariance;
  moved.claim.reset();
  if (!CanBeStored(moved)) return std::nullopt;
  return moved;
}

}  // namespace hypermap
