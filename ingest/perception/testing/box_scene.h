// Depth images of a floor and boxes, with exact masks, for tests of perception.
#ifndef HYPERMAP_INGEST_PERCEPTION_TESTING_BOX_SCENE_H_
#define HYPERMAP_INGEST_PERCEPTION_TESTING_BOX_SCENE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/perception/frame.h"
#include "ingest/perception/organised_cloud.h"

namespace hypermap::ingest::testing {

using Mask = std::vector<uint8_t>;

// A box along the axes of the frame, metres.
struct Cuboid {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

struct BoxScene {
  bool floor = true;  // Whether the plane z = 0 is visible.
  std::vector<Cuboid> boxes;
};

// Returns a camera of `width` x `width` * 3 / 4 pixels without distortion, whose horizontal field
// of view is 62 degrees.
CameraModel TestCamera(int width);

// Returns the pose of an optical frame (x right, y down, z forward) at `eye`. It looks along
// `yaw_rad` (counter-clockwise from the x axis) and `down_rad` below the horizon.
Eigen::Isometry3d LookFrom(const Eigen::Vector3d& eye, double yaw_rad, double down_rad);

// A rendered image, and the box that each pixel shows.
struct Shot {
  static constexpr int kFloor = -1;
  static constexpr int kNothing = -2;

  CameraModel camera;
  Eigen::Isometry3d pose;
  DepthImage depth;
  std::vector<int> seen;  // Index of each pixel's box, or kFloor or kNothing.

  OrganisedCloud Cloud() const { return CloudAt(pose); }
  // Returns the cloud as if the image had been taken from `elsewhere`.
  OrganisedCloud CloudAt(const Eigen::Isometry3d& elsewhere) const;
  // Returns the mask of the pixels that show the box with this index, or kFloor or kNothing.
  Mask MaskOf(int box) const;
  // Returns the image as a frame without instances, of robot "r1" with sequence 7.
  Frame AsFrame() const;
};

// Renders the scene with exact depth or, given a seed, with normal noise of DepthSigma().
Shot Photograph(const BoxScene& scene, const CameraModel& camera, const Eigen::Isometry3d& pose,
                std::optional<uint64_t> noise_seed = std::nullopt);

// Returns the mask dilated by `steps` pixels in all directions, diagonals included.
Mask Grown(const Mask& mask, int width, int steps);

// Returns the mask of a rectangle of the image, ends exclusive.
Mask Rectangle(int width, int height, int u_begin, int v_begin, int u_end, int v_end);

// Returns the indices of the mask's pixels, ascending.
std::vector<int32_t> PixelsOf(const Mask& mask);

}  // namespace hypermap::ingest::testing

#endif  // HYPERMAP_INGEST_PERCEPTION_TESTING_BOX_SCENE_H_
