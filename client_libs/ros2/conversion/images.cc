#include "client_libs/ros2/conversion/images.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/images/png.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

// The largest width and height of a camera that the FrameService takes.
constexpr uint32_t kMaxSide = 4096;
// The unit of the TUM RGB-D datasets. The worker uses depth up to 8 m.
constexpr double kUnitsPerMetre = 5000.0;
constexpr double kMaxUnits = 65'535.0;
// Coefficients of plumb_bob. The first five of rational_polynomial are the same.
constexpr size_t kCoefficients = 5;

absl::Status CheckDistortion(const sensor_msgs::CameraInfo& message) {
  const auto is_used = [](double k) { return k != 0.0; };
  const size_t known = std::min(message.d.size(), kCoefficients);
  const bool has_more = std::any_of(message.d.begin() + known, message.d.end(), is_used);
  const bool is_distorted = std::any_of(message.d.begin(), message.d.end(), is_used);
  const bool is_plumb_bob =
      message.distortion_model == "plumb_bob" || message.distortion_model == "rational_polynomial";
  if (!has_more && (!is_distorted || is_plumb_bob)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("the distortion model ", message.distortion_model,
                   " is not plumb_bob; rectify the images, and use --rectified"));
}

// Checks that the image has `bytes` for each pixel, and the size of the camera's images.
absl::Status CheckImage(const sensor_msgs::Image& image, const v1::CameraModel& camera,
                        size_t bytes) {
  if (int64_t{image.width} != camera.width() || int64_t{image.height} != camera.height()) {
    return absl::InvalidArgumentError(absl::StrCat("image of ", image.width, "x", image.height,
                                                   " for a camera of ", camera.width(), "x",
                                                   camera.height()));
  }
  if (image.step < image.width * bytes || image.data.size() < uint64_t{image.step} * image.height) {
    return absl::InvalidArgumentError("image with too few bytes");
  }
  return absl::OkStatus();
}

// The samples of an image of one channel, row-major.
template <typename Sample>
absl::StatusOr<std::vector<Sample>> SamplesOf(const sensor_msgs::Image& image,
                                              const v1::CameraModel& camera) {
  HYPERMAP_RETURN_IF_ERROR(CheckImage(image, camera, sizeof(Sample)));
  std::vector<Sample> samples(size_t{image.width} * image.height);
  for (size_t row = 0; row < image.height; ++row) {
    // All machines of the project are little-endian.
    std::memcpy(samples.data() + row * image.width, image.data.data() + row * image.step,
                image.width * sizeof(Sample));
  }
  if (image.is_bigendian == 0) return samples;
  for (Sample& sample : samples) {
    auto* const bytes = reinterpret_cast<uint8_t*>(&sample);
    std::reverse(bytes, bytes + sizeof(Sample));
  }
  return samples;
}

absl::Status UnknownEncoding(const sensor_msgs::Image& image, absl::string_view known) {
  return absl::InvalidArgumentError(
      absl::StrCat("image of encoding ", image.encoding, ", not ", known));
}

absl::StatusOr<std::string> EncodePng(const std::vector<uint16_t>& samples, int width, int height) {
  HYPERMAP_ASSIGN_OR_RETURN(
      PngWriter writer,
      PngWriter::Begin({.width = width, .height = height, .bit_depth = 16, .is_fast = true}));
  std::vector<uint8_t> row(2 * static_cast<size_t>(width));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const uint16_t sample = samples[static_cast<size_t>(v) * width + u];
      row[2 * u] = static_cast<uint8_t>(sample >> 8);
      row[2 * u + 1] = static_cast<uint8_t>(sample);
    }
    HYPERMAP_RETURN_IF_ERROR(writer.WriteRow(row.data()));
  }
  return std::move(writer).Finish();
}

template <typename Sample>
absl::Status CheckAnyDepth(const std::vector<Sample>& samples) {
  if (std::any_of(samples.begin(), samples.end(), [](Sample s) { return s > 0; })) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError("depth image without any depth");
}

absl::Status EncodeMillimetres(const std::vector<uint16_t>& depth, v1::RobotFrame* frame) {
  HYPERMAP_RETURN_IF_ERROR(CheckAnyDepth(depth));
  frame->set_millimetres(depth.data(), 2 * depth.size());
  return absl::OkStatus();
}

absl::Status EncodeMetres(const std::vector<float>& depth, const v1::CameraModel& camera,
                          v1::RobotFrame* frame) {
  std::vector<uint16_t> units(depth.size(), 0);
  for (size_t i = 0; i < depth.size(); ++i) {
    if (!std::isfinite(depth[i]) || depth[i] <= 0.0F) continue;
    units[i] = static_cast<uint16_t>(std::min(std::rint(depth[i] * kUnitsPerMetre), kMaxUnits));
  }
  HYPERMAP_RETURN_IF_ERROR(CheckAnyDepth(units));
  HYPERMAP_ASSIGN_OR_RETURN(*frame->mutable_png()->mutable_png(),
                            EncodePng(units, camera.width(), camera.height()));
  frame->mutable_png()->set_units_per_metre(kUnitsPerMetre);
  return absl::OkStatus();
}

template <typename Sample>
absl::StatusOr<std::vector<int32_t>> NumbersOf(const sensor_msgs::Image& image,
                                               const v1::CameraModel& camera) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Sample> samples, SamplesOf<Sample>(image, camera));
  return std::vector<int32_t>(samples.begin(), samples.end());
}

}  // namespace

absl::StatusOr<v1::CameraModel> ToCameraModel(const sensor_msgs::CameraInfo& message,
                                              bool is_rectified) {
  if (message.width < 1 || message.width > kMaxSide || message.height < 1 ||
      message.height > kMaxSide) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a camera of ", message.width, "x", message.height, "; each must lie in 1 to ", kMaxSide));
  }
  v1::CameraModel camera;
  camera.set_width(static_cast<int32_t>(message.width));
  camera.set_height(static_cast<int32_t>(message.height));
  // P has a column more than K.
  const double* const m = is_rectified ? message.p.data() : message.k.data();
  const int second_row = is_rectified ? 4 : 3;
  camera.set_fx(m[0]);
  camera.set_cx(m[2]);
  camera.set_fy(m[second_row + 1]);
  camera.set_cy(m[second_row + 2]);
  if (!(camera.fx() > 0.0 && camera.fy() > 0.0)) {
    return absl::InvalidArgumentError("the camera is not calibrated: its focal length is 0");
  }
  if (is_rectified) return camera;
  HYPERMAP_RETURN_IF_ERROR(CheckDistortion(message));
  const size_t known = std::min(message.d.size(), kCoefficients);
  camera.mutable_distortion()->Add(message.d.begin(), message.d.begin() + known);
  return camera;
}

absl::Status EncodeDepth(const sensor_msgs::Image& image, const v1::CameraModel& camera,
                         v1::RobotFrame* frame) {
  if (image.encoding == "16UC1" || image.encoding == "mono16") {
    HYPERMAP_ASSIGN_OR_RETURN(const auto depth, SamplesOf<uint16_t>(image, camera));
    return EncodeMillimetres(depth, frame);
  }
  if (image.encoding == "32FC1") {
    HYPERMAP_ASSIGN_OR_RETURN(const auto depth, SamplesOf<float>(image, camera));
    return EncodeMetres(depth, camera, frame);
  }
  return UnknownEncoding(image, "16UC1/mono16/32FC1");
}

absl::StatusOr<std::vector<int32_t>> LabelNumbers(const sensor_msgs::Image& image,
                                                  const v1::CameraModel& camera) {
  const std::string& encoding = image.encoding;
  if (encoding == "mono8" || encoding == "8UC1") return NumbersOf<uint8_t>(image, camera);
  if (encoding == "mono16" || encoding == "16UC1") return NumbersOf<uint16_t>(image, camera);
  if (encoding == "32SC1") return NumbersOf<int32_t>(image, camera);
  return UnknownEncoding(image, "mono8/8UC1/mono16/16UC1/32SC1");
}

}  // namespace hypermap::ros2
