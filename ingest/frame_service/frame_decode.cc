#include "ingest/frame_service/frame_decode.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "ingest/sources/depth_png.h"
#include "ingest/sources/mask.h"
#include "wire/time.h"

namespace hypermap::ingest {
namespace {

constexpr int kMaxSide = 16384;
// Largest difference of a quaternion's length from 1.
constexpr double kMaxLengthError = 0.01;
constexpr double kMillimetres = 1000.0;

absl::Status DecodePose(const v1::CameraPose& message, Frame& frame) {
  Eigen::Quaterniond rotation(message.qw(), message.qx(), message.qy(), message.qz());
  if (!(std::abs(rotation.norm() - 1.0) < kMaxLengthError)) {
    return absl::InvalidArgumentError("frame.pose: the quaternion has not length 1");
  }
  rotation.normalize();
  frame.frame_from_camera.linear() = rotation.toRotationMatrix();
  frame.frame_from_camera.translation() << message.x(), message.y(), message.z();
  if (!frame.frame_from_camera.matrix().allFinite()) {
    return absl::InvalidArgumentError("frame.pose is not finite");
  }
  if (message.covariance().empty()) return absl::OkStatus();
  if (message.covariance_size() != 9) {
    return absl::InvalidArgumentError("frame.pose.covariance has not nine numbers");
  }
  frame.pose_covariance =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(message.covariance().data());
  return absl::OkStatus();
}

absl::StatusOr<DepthImage> DecodeMillimetres(const std::string& bytes, const CameraModel& camera) {
  const size_t pixels = static_cast<size_t>(camera.width) * camera.height;
  if (bytes.size() != 2 * pixels) {
    return absl::InvalidArgumentError(absl::StrCat(
        "frame.millimetres has ", bytes.size(), " bytes, the camera's image takes ", 2 * pixels));
  }
  DepthImage image{camera.width, camera.height, std::vector<float>(pixels)};
  for (size_t i = 0; i < pixels; ++i) {
    const auto low = static_cast<uint8_t>(bytes[2 * i]);
    const auto high = static_cast<uint8_t>(bytes[2 * i + 1]);
    image.metres[i] = static_cast<float>(high << 8 | low) * static_cast<float>(1 / kMillimetres);
  }
  return image;
}

absl::StatusOr<DepthImage> DecodeDepth(const v1::RobotFrame& message, const CameraModel& camera) {
  switch (message.depth_case()) {
    case v1::RobotFrame::kPng: {
      const double units = message.png().units_per_metre();
      if (!(units >= 0.0 && units <= 1e9)) {
        return absl::InvalidArgumentError("frame.png.units_per_metre must be positive");
      }
      return DecodeDepthPng(message.png().png(), camera.width, camera.height,
                            units == 0.0 ? kMillimetres : units);
    }
    case v1::RobotFrame::kMillimetres:
      return DecodeMillimetres(message.millimetres(), camera);
    case v1::RobotFrame::DEPTH_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("frame.depth is missing");
}

absl::StatusOr<MaskEncoding> EncodingOf(const v1::FrameInstance& message,
                                        const CameraModel& camera) {
  if (message.mask_case() == v1::FrameInstance::kPackedRuns) {
    return MaskEncoding(PackedMaskRuns{camera.width, camera.height, message.packed_runs()});
  }
  if (message.mask_case() != v1::FrameInstance::kRuns) {
    return absl::InvalidArgumentError("no mask");
  }
  MaskRuns runs{camera.width, camera.height, {}};
  for (const int32_t count : message.runs().counts()) {
    if (count < 0) return absl::InvalidArgumentError("a negative length");
    runs.counts.push_back(static_cast<uint32_t>(count));
  }
  return MaskEncoding(std::move(runs));
}

double BestScore(const v1::FrameInstance& message) {
  double best = 0.0;
  for (const v1::ClassScore& score : message.scores()) best = std::max(best, score.score());
  return best;
}

absl::StatusOr<Instance> DecodeInstance(const v1::FrameInstance& message,
                                        const CameraModel& camera) {
  Instance instance;
  for (const v1::ClassScore& score : message.scores()) {
    if (!(score.score() > 0.0 && score.score() <= 1.0) || score.label().empty()) {
      return absl::InvalidArgumentError("a score out of range");
    }
    if (!instance.scores.emplace(score.label(), score.score()).second) {
      return absl::InvalidArgumentError("a label twice");
    }
  }
  if (instance.scores.empty()) return absl::InvalidArgumentError("no scores");
  HYPERMAP_ASSIGN_OR_RETURN(const MaskEncoding encoding, EncodingOf(message, camera));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<uint8_t> mask,
                            DecodeMask(encoding, camera.width, camera.height));
  instance.mask = std::move(mask);
  return instance;
}

}  // namespace

absl::StatusOr<FrameSource> DecodeOpening(const v1::FrameOpening& opening) {
  if (opening.robot().empty()) return absl::InvalidArgumentError("opening.robot is empty");
  const v1::CameraModel& camera = opening.camera();
  if (camera.width() < 1 || camera.width() > kMaxSide || camera.height() < 1 ||
      camera.height() > kMaxSide) {
    return absl::InvalidArgumentError(
        absl::StrCat("opening.camera: width and height must lie in 1 to ", kMaxSide));
  }
  if (!(camera.fx() > 0.0 && camera.fy() > 0.0)) {
    return absl::InvalidArgumentError("opening.camera: fx and fy must be positive");
  }
  FrameSource source{opening.robot(), opening.frame_id(), {}};
  source.camera = {camera.width(), camera.height(), camera.fx(), camera.fy(),
                   camera.cx(),    camera.cy(),     {}};
  if (camera.distortion_size() > 5) {
    return absl::InvalidArgumentError("opening.camera.distortion has more than five numbers");
  }
  std::copy(camera.distortion().begin(), camera.distortion().end(),
            source.camera.distortion.begin());
  return source;
}

absl::StatusOr<Frame> DecodeFrame(const FrameSource& source, const v1::RobotFrame& message,
                                  int max_instances, int& bad_instances) {
  Frame frame;
  frame.robot = source.robot;
  frame.frame_id = source.frame_id;
  frame.camera = source.camera;
  frame.sequence = message.sequence();
  if (!message.has_stamp()) return absl::InvalidArgumentError("frame.stamp is missing");
  frame.stamp = wire::DecodeTime(message.stamp());
  HYPERMAP_RETURN_IF_ERROR(DecodePose(message.pose(), frame));
  HYPERMAP_ASSIGN_OR_RETURN(DepthImage depth, DecodeDepth(message, source.camera));
  frame.depth = std::move(depth);

  std::vector<const v1::FrameInstance*> kept;
  for (const v1::FrameInstance& instance : message.instances()) kept.push_back(&instance);
  if (kept.size() > static_cast<size_t>(max_instances)) {
    bad_instances += static_cast<int>(kept.size()) - max_instances;
    std::stable_sort(kept.begin(), kept.end(),
                     [](const v1::FrameInstance* a, const v1::FrameInstance* b) {
                       return BestScore(*a) > BestScore(*b);
                     });
    kept.resize(max_instances);
  }
  for (const v1::FrameInstance* instance : kept) {
    absl::StatusOr<Instance> decoded = DecodeInstance(*instance, source.camera);
    if (decoded.ok()) {
      frame.instances.push_back(*std::move(decoded));
    } else {
      ++bad_instances;
    }
  }
  return frame;
}

}  // namespace hypermap::ingest
