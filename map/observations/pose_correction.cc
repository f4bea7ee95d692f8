#include "map/observations/pose_correction.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/frames/pose_covariance.h"
#include "map/geometry/coordinates.h"
#include "map/geometry/polygon.h"

namespace hypermap {
namespace {

// An optical axis is taken for vertical if it is within about 2.6 degrees of that.
constexpr double kLeastHorizontal = 0.045;

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

bool CanBeStored(const Polygon& polygon) {
  if (polygon.empty()) return true;
  const Box& box = polygon.bounds();
  return std::max({-box.min.x, -box.min.y, box.max.x, box.max.y}) <= kMaxCoordinate_m &&
         !RunsBackwards(polygon.rings());
}

bool CanBeStored(const Observation& observation) {
  return observation.pose.frame_from_camera.translation().cwiseAbs().maxCoeff() <=
             kMaxCoordinate_m &&
         CanBeStored(observation.view_hull) && CanBeStored(observation.free_space) &&
         std::all_of(observation.detections.begin(), observation.detections.end(),
                     [](const Detection& detection) {
                       return CanBeStored(detection.hull) &&
                              IsWithinBounds(detection.cells.frame_from_cells);
                     });
}

}  // namespace

PlanarTransform ViewPose(const Eigen::Isometry3d& frame_from_camera) {
  Eigen::Vector3d ahead = frame_from_camera.linear().col(2);
  if (std::hypot(ahead.x(), ahead.y()) < kLeastHorizontal) {
    ahead = -frame_from_camera.linear().col(1);
  }
  const Eigen::Vector3d& position = frame_from_camera.translation();
  return {position.x(), position.y(), std::atan2(ahead.y(), ahead.x())};
}

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
  const PlanarTransform claimed = ViewPose(observation.pose.frame_from_camera);
  Observation moved =
      Transformed(observation, pose.frame_from_view * claimed.Inverse(), observation.frame_id);
  moved.pose.covariance = pose.covariance;
  moved.claim.reset();
  if (!CanBeStored(moved)) return std::nullopt;
  return moved;
}

}  // namespace hypermap
