#include "ingest/perception/frame.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::ingest {
namespace {

// Bounds memory, and keeps pixel indices (v * width + u) within int32_t.
constexpr int kMaxImageSide = 16384;

absl::Status ValidateCamera(const CameraModel& camera) {
  if (camera.width < 1 || camera.height < 1 || camera.width > kMaxImageSide ||
      camera.height > kMaxImageSide) {
    return absl::InvalidArgumentError(
        absl::StrCat("camera: an image of ", camera.width, " x ", camera.height, " pixels"));
  }
  if (!(camera.fx > 0.0 && camera.fy > 0.0) || !std::isfinite(camera.fx) ||
      !std::isfinite(camera.fy) || !std::isfinite(camera.cx) || !std::isfinite(camera.cy) ||
      !std::all_of(std::begin(camera.distortion), std::end(camera.distortion),
                   [](double k) { return std::isfinite(k); })) {
    return absl::InvalidArgumentError("camera: calibration is not finite, or no focal length");
  }
  return absl::OkStatus();
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

absl::Status Validate(const Frame& frame) {
  HYPERMAP_RETURN_IF_ERROR(ValidateCamera(frame.camera));
  HYPERMAP_RETURN_IF_ERROR(ValidateDepth(frame.depth, frame.camera));
  const Eigen::Matrix4d m = frame.frame_from_camera.matrix();
  const Eigen::Matrix3d r = m.block<3, 3>(0, 0);
  if (!m.allFinite()) return absl::InvalidArgumentError("pose: not finite");
  if (!(r * r.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-6) || r.determinant() < 0.0) {
    return absl::InvalidArgumentError("pose: not a rotation");
  }
  if (!frame.pose_covariance.allFinite() || (frame.pose_covariance.diagonal().array() < 0).any()) {
    return absl::InvalidArgumentError("pose_covariance: not finite or negative");
  }
  for (size_t i = 0; i < frame.instances.size(); ++i) {
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
