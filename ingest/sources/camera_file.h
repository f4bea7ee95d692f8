// Camera calibrations in the format of ROS.
#ifndef HYPERMAP_INGEST_SOURCES_CAMERA_FILE_H_
#define HYPERMAP_INGEST_SOURCES_CAMERA_FILE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// Parses the YAML of camera_info: image_width, image_height, camera_matrix, distortion_model
// (plumb_bob or none) and distortion_coefficients. Errors: INVALID_ARGUMENT, naming the key;
// UNIMPLEMENTED for another distortion model.
absl::StatusOr<CameraModel> ParseCameraInfo(absl::string_view text);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_CAMERA_FILE_H_
