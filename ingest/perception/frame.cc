#include "ingest/perception/frame.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::ingest {
namespace {

constexpr double kMinFocalLength_px = 1.0;
constexpr double kMaxFocalLength_px = 1e6;
constexpr double kMaxPrincipalPoint_px = 1e6;
constexpr double kMaxDistortion = 1e6;
// The same as that of an observation's coordinates.
constexpr double kMaxPosition_m = 1e9;
constexpr double kMaxCovariance = 1e12;

// Returns INVALID_ARGUMENT unless low <= value <= high; also for NaN.
absl::Status CheckRange(absl::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must lie in ", low, " to ", high));
}

absl::Status ValidateDepth(const DepthImage& depth, const CameraModel& camera) {
  if (depth.width != camera.width || depth.height != camera.height) {
    return absl::InvalidArgumentError(absl::StrCat("depth: ", depth.width, " x ", depth.height,
                                                   " pixels, the camera has ", camera.width, " x ",
                                                   camera.height));
  }
  if (depth.metres.size() != static_cast<size_t>(depth.width) * depth.height) {
    return absl::InvalidArgumentError("depth: the number of values is not the image's");
  }
  int wrong = 0;
  for (const float z : depth.metres) {
    wrong |= !(z >= 0.0f) | !(z <= std::numeric_limits<float>::max());
  }
  if (wrong) return absl::InvalidArgumentError("depth: a value that is negative or not finite");
  return absl::OkStatus();
}

}  // namespace

bool CameraModel::distorted() const {
  return std::any_of(std::begin(distortion), std::end(distortion),
                     [](double k) { return k != 0.0; });
}

absl::Status Validate(const CameraModel& camera) {
  HYPERMAP_RETURN_IF_ERROR(CheckRange("camera.width", camera.width, 1, kMaxImageSide));
  HYPERMAP_RETURN_IF_ERROR(CheckRange("camera.height", camera.height, 1, kMaxImageSide));
  HYPERMAP_RETURN_IF_ERROR(
      CheckRange("camera.fx", camera.fx, kMinFocalLength_px, kMaxFocalLength_px));
  HYPERMAP_RETURN_IF_ERROR(
      CheckRange("camera.fy", camera.fy, kMinFocalLength_px, kMaxFocalLength_px));
  HYPERMAP_RETURN_IF_ERROR(
      CheckRange("camera.cx", camera.cx, -kMaxPrincipalPoint_px, kMaxPrincipalPoint_px));
  HYPERMAP_RETURN_IF_ERROR(
      CheckRange("camera.cy", camera.cy, -kMaxPrincipalPoint_px, kMaxPrincipalPoint_px));
  for (size_t i = 0; i < camera.distortion.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckRange(absl::StrCat("camera.distortion[", i, "]"),
                                        camera.distortion[i], -kMaxDistortion, kMaxDistortion));
  }
  return absl::OkStatus();
}

absl::Status Validate(const Frame& frame) {
  HYPERMAP_RETURN_IF_ERROR(Validate(frame.camera));
  HYPERMAP_RETURN_IF_ERROR(ValidateDepth(frame.depth, frame.camera));
  const Eigen::Matrix4d m = frame.frame_from_camera.matrix();
  const Eigen::Matrix3d r = m.block<3, 3>(0, 0);
  if (!m.allFinite()) return absl::InvalidArgumentError("pose: not finite");
  if (m.block<3, 1>(0, 3).cwiseAbs().maxCoeff() > kMaxPosition_m) {
    return absl::InvalidArgumentError(absl::StrCat("pose: farther than ", kMaxPosition_m, " m"));
  }
  if (!(r * r.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-6) || r.determinant() < 0.0) {
    return absl::InvalidArgumentError("pose: not a rotation");
  }
  if (frame.frame_from_view) {
    HYPERMAP_RETURN_IF_ERROR(CheckTranslation("pose", *frame.frame_from_view));
  }
  if (!frame.pose_covariance.allFinite() || (frame.pose_covariance.diagonal().array() < 0).any()) {
    return absl::InvalidArgumentError("pose_covariance: not finite or negative");
  }
  if (frame.pose_covariance.cwiseAbs().maxCoeff() > kMaxCovariance) {
    return absl::InvalidArgumentError(
        absl::StrCat("pose_covariance: a number beyond ", kMaxCovariance));
  }
  for (size_t i = 0; i < frame.instances.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const Instance& instance = frame.instances[i];
    if (instance.mask.size() != frame.depth.metres.size()) {
      return absl::InvalidArgumentError(
          absl::StrCat("instances[", i, "].mask: the number of pixels is not the image's"));
    }
    uint8_t bits = 0;
    for (const uint8_t pixel : instance.mask) bits |= pixel;
    if (bits > 1) {
      return absl::InvalidArgumentError(
          absl::StrCat("instances[", i, "].mask: a value other than 0 and 1"));
    }
    if (instance.scores.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("instances[", i, "].scores: empty"));
    }
    for (const auto& [label, score] : instance.scores) {
      if (!(score > 0.0 && score <= 1.0)) {
        return absl::InvalidArgumentError(
            absl::StrCat("instances[", i, "].scores[", label, "]: not in (0, 1]"));
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace hypermap::ingest
