#include "ingest/frame_service/frame_decode.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "ingest/sources/depth_png.h"
#include "ingest/sources/mask.h"
#include "wire/time.h"

namespace hypermap::ingest {
namespace {

// Bytes of the names in an opening.
constexpr size_t kMaxNameLength = 256;
// Largest difference of a quaternion's length from 1.
constexpr double kMaxLengthError = 0.01;
constexpr double kMaxUnitsPerMetre = 1e9;
constexpr double kMillimetres = 1000.0;
// Bytes of a class: a node of a map, besides its label.
constexpr int64_t kBytesOfClass = 96;
// A class is in the frame, among those of duplicates, twice in the observation, and in the request
// to the server.
constexpr int64_t kCopiesOfClass = 5;

absl::Status CheckName(absl::string_view field, const std::string& name) {
  if (name.size() <= kMaxNameLength) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " has ", name.size(), " bytes, more than ", kMaxNameLength));
}

absl::Status CheckSide(absl::string_view field, int side) {
  if (side >= 1 && side <= kMaxStreamedSide) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", side, "; it must lie in 1 to ", kMaxStreamedSide));
}

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
      if (units != 0.0 && !(units >= 1.0 && units <= kMaxUnitsPerMetre)) {
        return absl::InvalidArgumentError(absl::StrCat("frame.png.units_per_metre is ", units,
                                                       "; it must lie in 1 to ", kMaxUnitsPerMetre,
                                                       ", or be 0"));
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

absl::StatusOr<std::vector<uint8_t>> DecodeMask(const v1::FrameInstance& message,
                                                const CameraModel& camera) {
  switch (message.mask_case()) {
    case v1::FrameInstance::kRuns:
      return DecodeRuns(message.runs().counts(), camera.width, camera.height);
    case v1::FrameInstance::kPackedRuns:
      return DecodePackedRuns(message.packed_runs(), camera.width, camera.height);
    case v1::FrameInstance::MASK_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("no mask");
}

double BestScore(const v1::FrameInstance& message) {
  double best = 0.0;
  for (const v1::ClassScore& score : message.scores()) best = std::max(best, score.score());
  return best;
}

struct Candidate {
  int index;  // of the instance
  double score;
};

// Returns all instances or, if there are more than `most`, those with the highest scores, the
// highest first.
std::vector<const v1::FrameInstance*> BestInstances(const v1::RobotFrame& message, int most) {
  std::vector<Candidate> candidates;
  candidates.reserve(message.instances_size());
  for (int i = 0; i < message.instances_size(); ++i) {
    candidates.push_back({i, BestScore(message.instances(i))});
  }
  const auto last = candidates.begin() + std::min(message.instances_size(), most);
  if (last != candidates.end()) {
    std::partial_sort(candidates.begin(), last, candidates.end(),
                      [](const Candidate& a, const Candidate& b) {
                        return a.score != b.score ? a.score > b.score : a.index < b.index;
                      });
  }
  std::vector<const v1::FrameInstance*> best;
  for (auto it = candidates.begin(); it != last; ++it) {
    best.push_back(&message.instances(it->index));
  }
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
  HYPERMAP_ASSIGN_OR_RETURN(instance.mask, DecodeMask(message, camera));
  return instance;
}

}  // namespace

absl::StatusOr<FrameSource> DecodeOpening(const v1::FrameOpening& opening) {
  if (opening.robot().empty()) return absl::InvalidArgumentError("opening.robot is empty");
  HYPERMAP_RETURN_IF_ERROR(CheckName("opening.robot", opening.robot()));
  HYPERMAP_RETURN_IF_ERROR(CheckName("opening.frame_id", opening.frame_id()));
  const v1::CameraModel& camera = opening.camera();
  HYPERMAP_RETURN_IF_ERROR(CheckSide("opening.camera.width", camera.width()));
  HYPERMAP_RETURN_IF_ERROR(CheckSide("opening.camera.height", camera.height()));
  FrameSource source{opening.robot(), opening.frame_id(), {}};
  source.camera = {camera.width(), camera.height(), camera.fx(), camera.fy(),
                   camera.cx(),    camera.cy(),     {}};
  if (camera.distortion_size() > static_cast<int>(source.camera.distortion.size())) {
    return absl::InvalidArgumentError("opening.camera.distortion has more than five numbers");
  }
  std::copy(camera.distortion().begin(), camera.distortion().end(),
            source.camera.distortion.begin());
  if (const absl::Status status = Validate(source.camera); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("opening.", status.message()));
  }
  return source;
}

int64_t MemoryOfInstances(const FrameSource& source, const v1::RobotFrame& message,
                          int max_instances) {
  const int64_t pixels = int64_t{source.camera.width} * source.camera.height;
  int64_t bytes = message.instances_size() * static_cast<int64_t>(sizeof(Candidate));
  int64_t masks = 0;
  for (const v1::FrameInstance& instance : message.instances()) {
    masks += instance.mask_case() != v1::FrameInstance::MASK_NOT_SET;
    for (const v1::ClassScore& score : instance.scores()) {
      bytes += kCopiesOfClass * (kBytesOfClass + static_cast<int64_t>(score.label().size()));
    }
  }
  return bytes + std::min<int64_t>(masks, max_instances) * pixels;
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

  for (const v1::FrameInstance* instance : BestInstances(message, max_instances)) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::StatusOr<Instance> decoded = DecodeInstance(*instance, source.camera);
    if (decoded.ok()) {
      frame.instances.push_back(*std::move(decoded));
    } else {
      ++bad_instances;
    }
  }
  bad_instances += std::max(0, message.instances_size() - max_instances);
  return frame;
}

}  // namespace hypermap::ingest
