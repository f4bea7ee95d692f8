// One RGB-D frame as a source gives it: depth, where the camera was, and what a detector saw.
#ifndef HYPERMAP_INGEST_PERCEPTION_FRAME_H_
#define HYPERMAP_INGEST_PERCEPTION_FRAME_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace hypermap::ingest {

// A pinhole camera. Pixel centres have whole coordinates, (0, 0) is the top left one. Distortion is
// the plumb_bob model (Brown 1971, as in ROS camera_info): k1 k2 p1 p2 k3.
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

// Metres along the optical axis, row-major, top row first; 0 = no return, never NaN or negative.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<float> metres;

  float at(int u, int v) const { return metres[static_cast<size_t>(v) * width + u]; }
};

// A detector's instance. The mask has the size of the image: row-major, 0 or 1.
struct Instance {
  std::map<std::string, double> scores;  // class -> score in (0, 1]
  std::vector<uint8_t> mask;
};

struct Frame {
  std::string robot;
  int64_t sequence = 0;
  absl::Time stamp;
  std::string frame_id;  // of the pose
  CameraModel camera;
  DepthImage depth;
  Eigen::Isometry3d frame_from_camera = Eigen::Isometry3d::Identity();  // optical frame
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Zero();            // of x, y, yaw; m, rad
  std::vector<Instance> instances;
};

// INVALID_ARGUMENT naming what is wrong: sizes that differ, a pose that is not finite or not rigid,
// depth that is NaN or negative, scores out of range.
absl::Status Validate(const Frame& frame);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_FRAME_H_
