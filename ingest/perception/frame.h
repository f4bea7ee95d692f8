// An RGB-D frame, the input of perception: depth, the camera's pose, and detected instances.
#ifndef HYPERMAP_INGEST_PERCEPTION_FRAME_H_
#define HYPERMAP_INGEST_PERCEPTION_FRAME_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "map/frames/planar_transform.h"

namespace hypermap::ingest {

// The largest width and height of an image. Bounds memory, and keeps pixel indices (v * width + u)
// within int32_t.
inline constexpr int kMaxImageSide = 16384;

// A pinhole camera. Pixel centres have whole coordinates; (0, 0) is the centre of the top left
// pixel. `distortion` holds the coefficients k1, k2, p1, p2, k3 of the plumb_bob model (Brown 1971,
// as in ROS camera_info).
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  std::array<double, 5> distortion = {0.0, 0.0, 0.0, 0.0, 0.0};

  bool distorted() const;
  friend bool operator==(const CameraModel&, const CameraModel&) = default;
};

// Depth in metres along the optical axis, row-major, top row first. A pixel without a return is 0;
// no pixel is NaN or negative.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<float> metres;

  float at(int u, int v) const { return metres[static_cast<size_t>(v) * width + u]; }
};

// One detected instance. The mask has the size of the image, row-major, with the values 0 and 1.
struct Instance {
  std::map<std::string, double> scores;  // Score of each class, in (0, 1].
  std::vector<uint8_t> mask;
};

// `frame_id` names the frame in which the pose is given. `frame_from_camera` transforms from the
// optical frame (x right, y down, z forward). `pose_covariance` is of x, y (m) and yaw (rad).
// `frame_from_view` is the pose on the plane (map/observations/view_frame.h) if that is known to
// more digits than `frame_from_camera` has it; by default RoundedViewPose(frame_from_camera).
struct Frame {
  std::string robot;
  int64_t sequence = 0;
  absl::Time stamp;
  std::string frame_id;
  CameraModel camera;
  DepthImage depth;
  Eigen::Isometry3d frame_from_camera = Eigen::Isometry3d::Identity();
  std::optional<PlanarTransform> frame_from_view;
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Zero();
  std::vector<Instance> instances;
};

// Returns INVALID_ARGUMENT, naming the field and its value, if the image has no pixels or is larger
// than kMaxImageSide, or if a number of the calibration is beyond those of real cameras: focal
// lengths of 1 to 1e6 pixels, a principal point within 1e6 pixels, coefficients within 1e6.
absl::Status Validate(const CameraModel& camera);

// Returns INVALID_ARGUMENT, naming the field, if image sizes differ, the camera is not valid, the
// pose is not finite, not rigid or farther than 1e9 m, the covariance is not finite, beyond 1e12 or
// has a negative variance, depth is negative or not finite, or a score is out of range. CANCELLED
// if the work of this thread is cancelled.
absl::Status Validate(const Frame& frame);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_FRAME_H_
