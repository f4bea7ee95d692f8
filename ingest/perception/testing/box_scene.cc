#include "ingest/perception/testing/box_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "ingest/perception/depth_noise.h"

namespace hypermap::ingest::testing {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Returns the distance, in lengths of `ray`, from `eye` to the box; kNever if the ray misses the
// box or the box is behind. Intersects the ray with the box's slabs.
double Hit(const Cuboid& box, const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  double begin = 0.0;
  double end = kNever;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray[axis] == 0.0) {
      if (eye[axis] < box.low[axis] || eye[axis] > box.high[axis]) return kNever;
      continue;
    }
    const double a = (box.low[axis] - eye[axis]) / ray[axis];
    const double b = (box.high[axis] - eye[axis]) / ray[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin > 0.0 && begin < end ? begin : kNever;
}

}  // namespace

CameraModel TestCamera(int width) {
  const int height = width * 3 / 4;
  const double focal = 262.5 / 320.0 * width;
  return {width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0};
}

Eigen::Isometry3d LookFrom(const Eigen::Vector3d& eye, double yaw_rad, double down_rad) {
  const Eigen::Vector3d right(std::sin(yaw_rad), -std::cos(yaw_rad), 0.0);
  const Eigen::Vector3d forward(std::cos(down_rad) * std::cos(yaw_rad),
                                std::cos(down_rad) * std::sin(yaw_rad), -std::sin(down_rad));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = eye;
  return pose;
}

OrganisedCloud Shot::CloudAt(const Eigen::Isometry3d& elsewhere) const {
  return MakeCloud(depth, elsewhere, PixelRays(camera));
}

Mask Shot::MaskOf(int box) const {
  Mask mask(seen.size());
  std::transform(seen.begin(), seen.end(), mask.begin(),
                 [box](int pixel) { return static_cast<uint8_t>(pixel == box); });
  return mask;
}

Frame Shot::AsFrame() const {
  Frame frame;
  frame.robot = "r1";
  frame.sequence = 7;
  frame.stamp = absl::FromUnixMillis(1234567);
  frame.frame_id = "map";
  frame.camera = camera;
  frame.depth = depth;
  frame.frame_from_camera = pose;
  return frame;
}

Shot Photograph(const BoxScene& scene, const CameraModel& camera, const Eigen::Isometry3d& pose,
                std::optional<uint64_t> noise_seed) {
  Shot shot{camera, pose, {camera.width, camera.height, {}}, {}};
  std::mt19937_64 rng(noise_seed.value_or(0));
  std::normal_distribution<float> noise;
  const Eigen::Vector3d eye = pose.translation();
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = pose.linear() * Eigen::Vector3d((u - camera.cx) / camera.fx,
                                                                  (v - camera.cy) / camera.fy, 1.0);
      // The ray's component along the optical axis is 1, so that lengths along it are depths.
      double nearest = scene.floor && ray.z() < 0.0 ? -eye.z() / ray.z() : kNever;
      int seen = nearest < kNever ? Shot::kFloor : Shot::kNothing;
      for (size_t i = 0; i < scene.boxes.size(); ++i) {
        const double hit = Hit(scene.boxes[i], eye, ray);
        if (hit >= nearest) continue;
        nearest = hit;
        seen = static_cast<int>(i);
      }
      auto z = seen == Shot::kNothing ? 0.0f : static_cast<float>(nearest);
      if (noise_seed && z > 0.0f) z = std::max(0.001f, z + DepthSigma(z) * noise(rng));
      shot.depth.metres.push_back(z);
      shot.seen.push_back(seen);
    }
  }
  return shot;
}

Mask Grown(const Mask& mask, int width, int steps) {
  const int height = static_cast<int>(mask.size()) / width;
  Mask grown(mask.size(), 0);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (!mask[v * width + u]) continue;
      for (int row = std::max(0, v - steps); row <= std::min(height - 1, v + steps); ++row) {
        for (int col = std::max(0, u - steps); col <= std::min(width - 1, u + steps); ++col) {
          grown[row * width + col] = 1;
        }
      }
    }
  }
  return grown;
}

Mask Rectangle(int width, int height, int u_begin, int v_begin, int u_end, int v_end) {
  Mask mask(static_cast<size_t>(width) * height, 0);
  for (int v = v_begin; v < v_end; ++v) {
    for (int u = u_begin; u < u_end; ++u) mask[v * width + u] = 1;
  }
  return mask;
}

std::vector<int32_t> PixelsOf(const Mask& mask) {
  std::vector<int32_t> pixels;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (mask[i]) pixels.push_back(static_cast<int32_t>(i));
  }
  return pixels;
}

}  // namespace hypermap::ingest::testing
