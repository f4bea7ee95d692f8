// The points of a depth image, in the image's order.
#ifndef HYPERMAP_INGEST_PERCEPTION_ORGANISED_CLOUD_H_
#define HYPERMAP_INGEST_PERCEPTION_ORGANISED_CLOUD_H_

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// Row-major, top row first; `camera` points are in the optical frame (x right, y down, z forward),
// metres; z = 0 where there was no return.
struct OrganisedCloud {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3f> camera;
  // To the axes of the frame of the pose.
  Eigen::Matrix3f upright_from_camera = Eigen::Matrix3f::Identity();
  // The point of the plane below the camera.
  Eigen::Vector2d foot = Eigen::Vector2d::Zero();
  // Of the camera above the plane, metres.
  float height_of_camera = 0.0f;

  // A point along the axes of the frame of the pose, z up from the plane, x and y counted from
  // `foot`: so that single precision holds however far from the frame's origin.
  Eigen::Vector3f upright(int32_t pixel) const {
    Eigen::Vector3f p = upright_from_camera * camera[pixel];
    p.z() += height_of_camera;
    return p;
  }

  bool valid(int32_t pixel) const { return camera[pixel].z() > 0.0f; }
};

// Where the camera sees what lies along (x, y, 1), in pixels.
Eigen::Vector2d Project(const CameraModel& camera, const Eigen::Vector2d& ray);

// Rays through the pixels (z = 1), distortion undone. Made once a camera.
std::vector<Eigen::Vector2f> PixelRays(const CameraModel& camera);

// `rays` are those of the camera that took `depth`.
OrganisedCloud MakeCloud(const DepthImage& depth, const Eigen::Isometry3d& frame_from_camera,
                         const std::vector<Eigen::Vector2f>& rays);

// Makes it the cloud of the same image taken from another pose.
void MoveCloud(const Eigen::Isometry3d& frame_from_camera, OrganisedCloud* cloud);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_ORGANISED_CLOUD_H_
