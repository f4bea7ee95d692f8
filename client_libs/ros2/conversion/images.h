// Images of a depth camera as the FrameService takes them (docs/ros2.md, Detections).
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_IMAGES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_IMAGES_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_libs/ros2/messages/messages.h"
#include "hypermap/v1/frame_service.pb.h"

namespace hypermap::ros2 {

// The camera of images that are rectified (matrix P, no distortion) or not (matrix K, distortion
// D). INVALID_ARGUMENT if it can't be expressed as a pinhole camera with plumb_bob.
absl::StatusOr<v1::CameraModel> ToCameraModel(const sensor_msgs::CameraInfo& message,
                                              bool is_rectified);

// Sets the depth of a frame. The image is 16UC1 or mono16 in millimetres, which is passed on, or
// 32FC1 in metres, which becomes a PNG in steps of 0.2 mm up to 13.1 m. INVALID_ARGUMENT if it is
// none of them, has not the size of the camera's images, or has no depth at all.
absl::Status EncodeDepth(const sensor_msgs::Image& image, const v1::CameraModel& camera,
                         v1::RobotFrame* frame);

// The number of each pixel of a label image, row-major: mono8, 8UC1, mono16, 16UC1 or 32SC1.
// INVALID_ARGUMENT as above.
absl::StatusOr<std::vector<int32_t>> LabelNumbers(const sensor_msgs::Image& image,
                                                  const v1::CameraModel& camera);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_IMAGES_H_
