#include "ingest/perception/organised_cloud.h"

#include <cmath>
#include <limits>

#include "base/cancellation/cancellation.h"

namespace hypermap::ingest {
namespace {

// Tangent of the largest angle between a ray and the optical axis.
constexpr double kMaxSlope = 500.0;

// Factors of the plumb_bob model (Brown 1971; Heikkila and Silven 1997, eq. 4) at a point p:
// distorted = p * radial + tangential.
struct Distortion {
  double radial = 1.0;
  Eigen::Vector2d tangential = Eigen::Vector2d::Zero();
};

Distortion DistortionAt(const CameraModel& camera, const Eigen::Vector2d& p) {
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  const double r2 = p.squaredNorm();
  return {1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)),
          {2.0 * p1 * p.x() * p.y() + p2 * (r2 + 2.0 * p.x() * p.x()),
           p1 * (r2 + 2.0 * p.y() * p.y()) + 2.0 * p2 * p.x() * p.y()}};
}

// Inverts the model, which has no closed inverse, by fixed point iteration, as OpenCV's
// undistortPoints does. Twenty rounds reach single precision for lenses whose distortion stays
// below a third.
Eigen::Vector2d Undistorted(const CameraModel& camera, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d p = distorted;
  for (int round = 0; round < 20; ++round) {
    const Distortion at = DistortionAt(camera, p);
    p = (distorted - at.tangential) / at.radial;
  }
  return p;
}

}  // namespace

Eigen::Vector2d Project(const CameraModel& camera, const Eigen::Vector2d& ray) {
  const Distortion at = DistortionAt(camera, ray);
  const Eigen::Vector2d seen = ray * at.radial + at.tangential;
  return {camera.fx * seen.x() + camera.cx, camera.fy * seen.y() + camera.cy};
}

std::vector<Eigen::Vector2f> PixelRays(const CameraModel& camera) {
  std::vector<Eigen::Vector2f> rays;
  rays.reserve(static_cast<size_t>(camera.width) * camera.height);
  const bool distorted = camera.distorted();
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (int v = 0; v < camera.height; ++v) {
    if (IsCancelled()) return rays;
    for (int u = 0; u < camera.width; ++u) {
      Eigen::Vector2d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
      if (distorted) ray = Undistorted(camera, ray);
      // False for NaN, too, at which the iteration of Undistorted may arrive.
      const bool found = std::abs(ray.x()) <= kMaxSlope && std::abs(ray.y()) <= kMaxSlope;
      rays.push_back(found ? Eigen::Vector2f(ray.cast<float>()) : Eigen::Vector2f(kNone, kNone));
    }
  }
  return rays;
}

OrganisedCloud MakeCloud(const DepthImage& depth, const Eigen::Isometry3d& frame_from_camera,
                         const std::vector<Eigen::Vector2f>& rays) {
  OrganisedCloud cloud;
  cloud.width = depth.width;
  cloud.height = depth.height;
  const size_t pixels = depth.metres.size();
  cloud.camera.resize(pixels);
  const float* metres = depth.metres.data();
  for (size_t i = 0; i < pixels; ++i) {
    const bool has_ray = !std::isnan(rays[i].x());
    const Eigen::Vector2f ray = has_ray ? rays[i] : Eigen::Vector2f(0.0f, 0.0f);
    const float z = has_ray ? metres[i] : 0.0f;
    cloud.camera[i] = {ray.x() * z, ray.y() * z, z};
  }
  MoveCloud(frame_from_camera, &cloud);
  return cloud;
}

void MoveCloud(const Eigen::Isometry3d& frame_from_camera, OrganisedCloud* cloud) {
  const Eigen::Vector3d position = frame_from_camera.translation();
  cloud->upright_from_camera = frame_from_camera.linear().cast<float>();
  cloud->height_of_camera = static_cast<float>(position.z());
  cloud->foot = position.head<2>();
}

}  // namespace hypermap::ingest
