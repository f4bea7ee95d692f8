// Depth images of a floor and boxes, with exact masks: what tests of perception look at.
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

// Along the axes of the frame, metres.
struct Cuboid {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

struct BoxScene {
  bool floor = true;  // z = 0
  std::vector<Cuboid> boxes;
};

// 62 degrees wide, `width` x `width` * 3 / 4 pixels, no distortion.
CameraModel TestCamera(int width);

// Of an optical frame (x right, y down, z forward) at `eye` that looks along `yaw_rad` (0: the x
// axis, counter-clockwise) and `down_rad` below the horizon.
Eigen::Isometry3d LookFrom(const Eigen::Vector3d& eye, double yaw_rad, double down_rad);

struct Shot {
  static constexpr int kFloor = -1;
  static constexpr int kNothing = -2;

  CameraModel camera;
  Eigen::Isometry3d pose;
  DepthImage depth;
  std::vector<int> seen;  // each pixel's box, kFloor or kNothing

  OrganisedCloud Cloud() const { return CloudAt(pose); }
  // As if it had been taken from there.
  OrganisedCloud CloudAt(const Eigen::Isometry3d& elsewhere) const;
  // The pixels that show the box (or floor).
  Mask MaskOf(int box) const;
  // Without instances; the robot is "r1" and the sequence 7.
  Frame AsFrame() const;
};

// Exact depth, or, given a seed, with normal noise of DepthSigma().
Shot Photograph(const BoxScene& scene, const CameraModel& camera, const Eigen::Isometry3d& pose,
                std::optional<uint64_t> noise_seed = std::nullopt);

// The mask and all pixels at most `steps` (diagonal ones too) from it.
Mask Grown(const Mask& mask, int width, int steps);

// A rectangle of the image, ends exclusive.
Mask Rectangle(int width, int height, int u_begin, int v_begin, int u_end, int v_end);

// The mask's pixels, ascending.
std::vector<int32_t> PixelsOf(const Mask& mask);

}  // namespace hypermap::ingest::testing

#endif  // HYPERMAP_INGEST_PERCEPTION_TESTING_BOX_SCENE_H_
