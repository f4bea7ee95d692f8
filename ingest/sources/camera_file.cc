#include "ingest/sources/camera_file.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::ingest {
namespace {

// The limit of Validate(Frame).
constexpr int kMaxSide = 1 << 14;

// Reads the calibration, and the name of its distortion model into `model`. Throws YAML::Exception.
CameraModel Read(const YAML::Node& file, std::string& model) {
  CameraModel camera;
  camera.width = file["image_width"].as<int>();
  camera.height = file["image_height"].as<int>();
  const auto matrix = file["camera_matrix"]["data"].as<std::vector<double>>();
  if (matrix.size() == 9) {
    camera.fx = matrix[0];
    camera.cx = matrix[2];
    camera.fy = matrix[4];
    camera.cy = matrix[5];
  }
  // A calibration without these keys has no distortion.
  const YAML::Node name = file["distortion_model"];
  model = name ? name.as<std::string>("") : "";
  const YAML::Node coefficients = file["distortion_coefficients"];
  std::vector<double> distortion;
  if (coefficients) distortion = coefficients["data"].as<std::vector<double>>();
  std::copy_n(distortion.begin(), std::min<size_t>(distortion.size(), 5),
              camera.distortion.begin());
  return camera;
}

}  // namespace

absl::StatusOr<CameraModel> ParseCameraInfo(absl::string_view text) {
  CameraModel camera;
  std::string model;
  try {
    camera = Read(YAML::Load(std::string(text)), model);
  } catch (const YAML::Exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("no camera_info: ", e.what()));
  }
  if (!model.empty() && model != "plumb_bob" && model != "none") {
    return absl::UnimplementedError(
        absl::StrCat("distortion_model \"", model, "\": only plumb_bob is known"));
  }
  if (camera.width < 1 || camera.width > kMaxSide || camera.height < 1 ||
      camera.height > kMaxSide) {
    return absl::InvalidArgumentError(
        absl::StrCat("image_width and image_height must lie in 1 to ", kMaxSide));
  }
  const bool plausible = camera.fx > 0.0 && camera.fy > 0.0 && std::isfinite(camera.fx) &&
                         std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                         std::isfinite(camera.cy);
  if (!plausible) {
    return absl::InvalidArgumentError(
        "camera_matrix.data is no matrix [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
  }
  for (const double k : camera.distortion) {
    if (!std::isfinite(k)) {
      return absl::InvalidArgumentError("distortion_coefficients.data is not finite");
    }
  }
  return camera;
}

}  // namespace hypermap::ingest
