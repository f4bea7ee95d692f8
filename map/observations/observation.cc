#include "map/observations/observation.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/frames/pose_covariance.h"
#include "map/geometry/coordinates.h"
#include "map/geometry/polygon.h"
#include "map/observations/view_frame.h"

namespace hypermap {
namespace {

constexpr double kMaxHeight_m = 1e4;
// Largest index of a patch's cells, which count from its own origin: not that of a grid layer.
constexpr int32_t kMaxCell = 1 << 22;
constexpr int32_t kMaxViewSide = 4096;

absl::Status Invalid(absl::string_view field, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat(field, " ", problem));
}

absl::Status ValidateScores(absl::string_view field, const std::map<std::string, double>& scores) {
  if (scores.empty()) return Invalid(field, "is empty");
  for (const auto& [label, score] : scores) {
    if (absl::StripAsciiWhitespace(label).empty()) return Invalid(field, "has an empty class");
    for (const char c : label) {
      if (absl::ascii_iscntrl(c)) return Invalid(field, "has a class with a control character");
    }
    if (!(score > 0.0 && score <= 1.0)) {
      return Invalid(absl::StrCat(field, "[", label, "]"), "must be in (0, 1]");
    }
  }
  return absl::OkStatus();
}

absl::Status ValidateCells(absl::string_view field, const CellPatch& cells) {
  if (!(cells.resolution_m > 1e-4 && cells.resolution_m <= 10.0)) {
    return Invalid(absl::StrCat(field, ".resolution_m"), "must be in (0.0001, 10]");
  }
  const CellSpan* before = nullptr;
  for (const CellSpan& span : cells.spans) {
    if (std::abs(span.row) > kMaxCell || span.col_begin < -kMaxCell || span.col_end > kMaxCell ||
        span.col_begin >= span.col_end) {
      return Invalid(absl::StrCat(field, ".spans"), "holds an empty or too far span");
    }
    if (before &&
        (span.row < before->row || (span.row == before->row && span.col_begin < before->col_end))) {
      return Invalid(absl::StrCat(field, ".spans"), "are not sorted or overlap");
    }
    before = &span;
  }
  return absl::OkStatus();
}

absl::Status ValidateDetection(const std::string& field, const Detection& detection) {
  HYPERMAP_RETURN_IF_ERROR(ValidateScores(field + ".scores", detection.scores));
  if (detection.hull.empty()) return Invalid(field + ".hull", "is empty");
  HYPERMAP_RETURN_IF_ERROR(ValidateCells(field + ".cells", detection.cells));
  if (!(std::abs(detection.height.low_m) <= kMaxHeight_m) ||
      !(std::abs(detection.height.high_m) <= kMaxHeight_m) ||
      detection.height.low_m > detection.height.high_m) {
    return Invalid(field + ".height", "must lie within 10 km, the low end first");
  }
  if (detection.num_points < 0) return Invalid(field + ".num_points", "is negative");
  if (!(detection.range_m >= 0.0) || !std::isfinite(detection.range_m)) {
    return Invalid(field + ".range_m", "must be finite and not negative");
  }
  if (!(detection.truncation >= 0.0 && detection.truncation <= 1.0)) {
    return Invalid(field + ".truncation", "must be in [0, 1]");
  }
  if (!(detection.weight > 0.0 && detection.weight <= 1.0)) {
    return Invalid(field + ".weight", "must be in (0, 1]");
  }
  return absl::OkStatus();
}

absl::Status ValidateView(const DepthView& view, size_t num_detections) {
  if (view.columns < 1 || view.columns > kMaxViewSide || view.rows < 1 ||
      view.rows > kMaxViewSide) {
    return Invalid("depth", absl::StrCat("must have 1 to ", kMaxViewSide, " columns and rows"));
  }
  if (!(view.fx > 0.0 && view.fy > 0.0) || !std::isfinite(view.fx) || !std::isfinite(view.fy) ||
      !std::isfinite(view.cx) || !std::isfinite(view.cy)) {
    return Invalid("depth", "has a camera that is not finite, or no focal length");
  }
  const size_t pixels = static_cast<size_t>(view.columns) * view.rows;
  if (view.depth_mm.size() != pixels) {
    return Invalid("depth.depth_mm", absl::StrCat("must have ", pixels, " values"));
  }
  if (view.owner.size() != pixels) {
    return Invalid("depth.owner", absl::StrCat("must have ", pixels, " values"));
  }
  for (const uint8_t owner : view.owner) {
    if (owner > num_detections && owner != DepthView::kSeveral) {
      return Invalid("depth.owner", "names a detection that there is not");
    }
  }
  return absl::OkStatus();
}

absl::Status ValidatePose(const SensorPose& pose) {
  const Eigen::Matrix4d m = pose.frame_from_camera.matrix();
  if (!m.allFinite() || m.block<3, 1>(0, 3).cwiseAbs().maxCoeff() > kMaxCoordinate_m) {
    return Invalid("pose", "is not finite or too far");
  }
  const Eigen::Matrix3d r = m.block<3, 3>(0, 0);
  if (!(r * r.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-6) || r.determinant() < 0.0) {
    return Invalid("pose", "has no rotation");
  }
  if (!IsPoseCovariance(pose.covariance)) {
    return Invalid("pose.covariance", "must be finite, symmetric and not negative");
  }
  return absl::OkStatus();
}

// Tolerance of the camera's place in the frame of its view, metres and radians.
constexpr double kViewTolerance = 1e-6;

bool CanBeStored(const Polygon& polygon) {
  if (polygon.empty()) return true;
  const Box& box = polygon.bounds();
  return std::max({-box.min.x, -box.min.y, box.max.x, box.max.y}) <= kMaxCoordinate_m &&
         !RunsBackwards(polygon.rings());
}

// Of an observation that is relative to its view.
absl::Status ValidateViewFrame(const Observation& observation) {
  const PlanarTransform camera = ViewPose(observation.pose.frame_from_camera);
  if (!(std::max(std::abs(camera.x()), std::abs(camera.y())) <= kViewTolerance &&
        std::abs(camera.yaw()) <= kViewTolerance)) {
    return Invalid("view.camera", "is not above the origin of its view, or does not look along x");
  }
  HYPERMAP_RETURN_IF_ERROR(CheckTranslation("view.frame_from_view", *observation.frame_from_view));
  if (!CanBeStored(Placed(observation))) {
    return Invalid("view.frame_from_view", "is too far away for what was seen");
  }
  return absl::OkStatus();
}

void MoveCoordinates(const PlanarTransform& target_from_source, Observation* observation) {
  if (target_from_source.IsIdentity()) return;
  Eigen::Isometry3d& camera = observation->pose.frame_from_camera;
  camera = target_from_source.InSpace() * camera;
  observation->view_hull = target_from_source * observation->view_hull;
  observation->free_space = target_from_source * observation->free_space;
  for (Detection& detection : observation->detections) {
    detection.hull = target_from_source * detection.hull;
    detection.cells.frame_from_cells = target_from_source * detection.cells.frame_from_cells;
  }
}

}  // namespace

ObservationKey KeyOf(const Observation& observation) {
  return {observation.stamp, observation.robot, observation.sequence};
}

absl::Status ValidateRobotName(absl::string_view robot) {
  if (robot.empty() || robot.size() > 256) return Invalid("robot", "must have 1 to 256 bytes");
  for (const char c : robot) {
    if (absl::ascii_iscntrl(c)) return Invalid("robot", "holds a control character");
  }
  return absl::OkStatus();
}

absl::Status Validate(const Observation& observation) {
  HYPERMAP_RETURN_IF_ERROR(ValidateRobotName(observation.robot));
  if (observation.sequence < 0) return Invalid("sequence", "is negative");
  if (observation.stamp == absl::InfinitePast() || observation.stamp == absl::InfiniteFuture()) {
    return Invalid("stamp", "is not finite");
  }
  HYPERMAP_RETURN_IF_ERROR(ValidatePose(observation.pose));
  if (observation.claim && !IsPoseCovariance(observation.claim->covariance)) {
    return Invalid("claim.covariance", "must be finite, symmetric and not negative");
  }
  if (observation.depth) {
    HYPERMAP_RETURN_IF_ERROR(ValidateView(*observation.depth, observation.detections.size()));
  }
  if (observation.detections.size() > kMaxDetections) {
    return Invalid("detections", absl::StrCat("are more than ", kMaxDetections));
  }
  for (size_t i = 0; i < observation.detections.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(
        ValidateDetection(absl::StrCat("detections[", i, "]"), observation.detections[i]));
  }
  return observation.frame_from_view ? ValidateViewFrame(observation) : absl::OkStatus();
}

Observation Placed(const Observation& observation) {
  Observation placed = observation;
  if (!observation.frame_from_view) return placed;
  placed.frame_from_view.reset();
  MoveCoordinates(*observation.frame_from_view, &placed);
  return placed;
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

Observation Transformed(const Observation& observation, const PlanarTransform& target_from_source,
                        const std::string& target_frame_id) {
  Observation moved = observation;
  moved.frame_id = target_frame_id;
  if (target_from_source.IsIdentity()) return moved;
  moved.pose.covariance = TransformedCovariance(observation.pose.covariance, target_from_source);
  if (moved.claim) {
    moved.claim->frame_from_view = target_from_source * observation.claim->frame_from_view;
    moved.claim->covariance =
        TransformedCovariance(observation.claim->covariance, target_from_source);
  }
  if (moved.frame_from_view) {
    moved.frame_from_view = target_from_source * *observation.frame_from_view;
  } else {
    MoveCoordinates(target_from_source, &moved);
  }
  return moved;
}

}  // namespace hypermap
