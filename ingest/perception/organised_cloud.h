// The points of a depth image, one per pixel.
#ifndef HYPERMAP_INGEST_PERCEPTION_ORGANISED_CLOUD_H_
#define HYPERMAP_INGEST_PERCEPTION_ORGANISED_CLOUD_H_

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// Points of an image of `width` x `height` pixels, row-major, top row first.
struct OrganisedCloud {
  int width = 0;
  int height = 0;
  // Positions in the optical frame (x right, y down, z forward), metres; z = 0 without a return.
  std::vector<Eigen::Vector3f> camera;
  // Rotation from the optical frame to the axes of the pose's frame.
  Eigen::Matrix3f upright_from_camera = Eigen::Matrix3f::Identity();
  // The point of the plane z = 0 below the camera, in the pose's frame.
  Eigen::Vector2d foot = Eigen::Vector2d::Zero();
  // Height of the camera above the plane, metres.
  float height_of_camera = 0.0f;

  // Returns the point of `pixel` along the axes of the pose's frame: z above the plane, x and y
  // relative to `foot`, so that single precision suffices at any distance from the frame's origin.
  Eigen::Vector3f upright(int32_t pixel) const {
    Eigen::Vector3f p = upright_from_camera * camera[pixel];
    p.z() += height_of_camera;
    return p;
  }

  bool valid(int32_t pixel) const { return camera[pixel].z() > 0.0f; }
};

// Returns the image position, in pixels, of points along the ray (x, y, 1) of the optical frame.
Eigen::Vector2d Project(const CameraModel& camera, const Eigen::Vector2d& ray);

// Returns the undistorted ray (x, y, 1) of each pixel as (x, y), row-major. Pixels whose ray is not
// found, because the model of distortion has no inverse there, or is farther than 89.9 degrees from
// the optical axis, have NaN. Expensive for distorted cameras: compute the rays once per camera.
// Breaks off, and returns anything, when the work of this thread is cancelled.
std::vector<Eigen::Vector2f> PixelRays(const CameraModel& camera);

// Returns the cloud of `depth`. `rays` are the PixelRays() of the camera that took it; pixels
// without a ray have no return.
OrganisedCloud MakeCloud(const DepthImage& depth, const Eigen::Isometry3d& frame_from_camera,
                         const std::vector<Eigen::Vector2f>& rays);

// Replaces the cloud's pose; the points in the optical frame stay.
void MoveCloud(const Eigen::Isometry3d& frame_from_camera, OrganisedCloud* cloud);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_ORGANISED_CLOUD_H_
