#include "simulation/worlds/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "simulation/worlds/pixel_box.h"
#include "simulation/worlds/wall_fan.h"

namespace hypermap::simulation {
namespace {

using ingest::CameraModel;
using ingest::DepthImage;

constexpr double kNearest = 0.4;
constexpr double kFarthest = 8.0;

// Returns the pixels that may show the prism: the bounding box of its projected corners. If a
// corner is less than 5 cm in front of the camera, its projection is unusable and all pixels are
// returned; none if all corners are behind the camera.
PixelBox PixelsOf(const Prism& prism, const CameraModel& camera,
                  const Eigen::Isometry3d& camera_from_world) {
  double u_low = camera.width, u_high = -1, v_low = camera.height, v_high = -1;
  bool some_near = false, all_behind = true;
  for (const Point& p : prism.footprint) {
    for (const double z : {prism.low_m, prism.high_m}) {
      const Eigen::Vector3d q = camera_from_world * Eigen::Vector3d(p.x, p.y, z);
      all_behind = all_behind && q.z() <= 0.0;
      some_near = some_near || q.z() < 0.05;
      if (some_near) continue;
      const double u = camera.fx * q.x() / q.z() + camera.cx;
      const double v = camera.fy * q.y() / q.z() + camera.cy;
      u_low = std::min(u_low, u);
      u_high = std::max(u_high, u);
      v_low = std::min(v_low, v);
      v_high = std::max(v_high, v);
    }
  }
  if (all_behind) return {};
  if (some_near) return {0, camera.width, 0, camera.height};
  const auto clamp = [](double v, int size) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(size)));
  };
  return {clamp(std::floor(u_low), camera.width), clamp(std::ceil(u_high) + 1, camera.width),
          clamp(std::floor(v_low), camera.height), clamp(std::ceil(v_high) + 1, camera.height)};
}

// Plain numbers instead of Eigen's vectors, because the loop over rays dominates the cost of a
// drive.
struct Direction {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

// Returns the ray of each pixel, with a component of 1 along the optical axis, so that a ray's
// parameter is the depth.
std::vector<Direction> RaysOf(const CameraModel& camera,
                              const Eigen::Isometry3d& world_from_camera) {
  std::vector<Direction> rays;
  rays.reserve(static_cast<size_t>(camera.width) * camera.height);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d d =
          world_from_camera.linear() *
          Eigen::Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      rays.push_back({d.x(), d.y(), d.z()});
    }
  }
  return rays;
}

// A face of a prism. `normal` points outwards (its length is arbitrary), and `height` is the
// signed distance of the rays' origin from the face in units of `normal`.
struct Face {
  double height = 0.0;
  Direction normal;
};

std::vector<Face> FacesOf(const Prism& prism, const Eigen::Vector3d& origin) {
  std::vector<Face> faces{{prism.low_m - origin.z(), {0.0, 0.0, -1.0}},
                          {origin.z() - prism.high_m, {0.0, 0.0, 1.0}}};
  Point a = prism.footprint.back();
  for (const Point& b : prism.footprint) {
    // The footprint is counter-clockwise, so that its inside is to the left of a -> b.
    const double nx = b.y - a.y, ny = a.x - b.x;
    faces.push_back({nx * (origin.x() - a.x) + ny * (origin.y() - a.y), {nx, ny, 0.0}});
    a = b;
  }
  return faces;
}

// Returns the depth at which the ray enters the prism; 0 if it misses the prism or begins inside.
// A ray is inside a convex solid from the last face that it enters to the first that it leaves.
double Hit(const std::vector<Face>& faces, const Direction& ray) {
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  for (const Face& face : faces) {
    const double climb = face.normal.x * ray.x + face.normal.y * ray.y + face.normal.z * ray.z;
    if (climb > 0.0) {
      leave = std::min(leave, -face.height / climb);
    } else if (climb < 0.0) {
      enter = std::max(enter, -face.height / climb);
    } else if (face.height > 0.0) {
      return 0.0;
    }
    if (enter >= leave) return 0.0;
  }
  return enter;
}

// Draws prisms into a view with a depth buffer: the nearest surface of each pixel stays.
class Painter {
 public:
  Painter(const CameraModel& camera, const Eigen::Isometry3d& world_from_camera, View& view)
      : camera_(camera),
        origin_(world_from_camera.translation()),
        camera_from_world_(world_from_camera.inverse()),
        rays_(RaysOf(camera, world_from_camera)),
        view_(view) {}

  void Draw(const Prism& prism, int16_t body) {
    const PixelBox box = PixelsOf(prism, camera_, camera_from_world_);
    const std::vector<Face> faces = FacesOf(prism, origin_);
    for (int v = box.v_begin; v < box.v_end; ++v) {
      for (int u = box.u_begin; u < box.u_end; ++u) {
        const size_t at = static_cast<size_t>(v) * camera_.width + u;
        const double hit = Hit(faces, rays_[at]);
        float& depth = view_.depth.metres[at];
        if (hit <= 0.0 || (depth > 0.0f && hit >= depth)) continue;
        depth = static_cast<float>(hit);
        view_.body[at] = body;
      }
    }
  }

  // REQUIRES: nothing has been drawn yet, because the walls overwrite the depth buffer.
  void Draw(const WallGrid& walls) {
    const WallFan fan(walls, Ahead());
    for (size_t at = 0; at < rays_.size(); ++at) {
      const Direction& ray = rays_[at];
      const auto hit = fan.Hit({ray.x, ray.y, ray.z}, kFarthest);
      if (hit) view_.depth.metres[at] = static_cast<float>(*hit);
    }
  }

 private:
  // Returns the horizontal directions of all rays; none if some of them lead backwards. The
  // extremes are at the image's corners, because the ratio of two linear functions has them there.
  FanView Ahead() const {
    const Eigen::Vector3d axis = camera_from_world_.linear().row(2).transpose();
    const double length = std::hypot(axis.x(), axis.y());
    const Point forward{axis.x() / length, axis.y() / length};
    FanView ahead{origin_, forward, 0.0, 0.0, 0.0};
    const size_t right = static_cast<size_t>(camera_.width) - 1;
    for (const size_t corner : {size_t{0}, right, rays_.size() - 1 - right, rays_.size() - 1}) {
      const Direction& ray = rays_[corner];
      const double along = ray.x * forward.x + ray.y * forward.y;
      if (!(along > 0.0)) return {origin_, forward, 0.0, 0.0, 0.0};
      const double slope = (ray.y * forward.x - ray.x * forward.y) / along;
      ahead.slope_low = std::min(ahead.slope_low, slope);
      ahead.slope_high = std::max(ahead.slope_high, slope);
      ahead.reach_m = std::max(ahead.reach_m, kFarthest * along);
    }
    return ahead;
  }

  const CameraModel camera_;
  const Eigen::Vector3d origin_;
  const Eigen::Isometry3d camera_from_world_;
  const std::vector<Direction> rays_;
  View& view_;
};

// Returns the depth of a neighbour across an edge; nullopt if the pixel is not at an edge.
std::optional<float> DepthAcrossEdge(const DepthImage& depth, int u, int v) {
  const float here = depth.at(u, v);
  const float limit = 0.05f + 0.02f * here;
  for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    const int nu = u + du, nv = v + dv;
    if (nu < 0 || nv < 0 || nu >= depth.width || nv >= depth.height) continue;
    if (std::abs(depth.at(nu, nv) - here) > limit) return depth.at(nu, nv);
  }
  return std::nullopt;
}

float Measure(double z, Random& random) {
  const double step = 2.85e-3 * z * z;
  const double measured = z + random.Normal(1.425e-3 * z * z);
  const double rounded = std::round(measured / step) * step;
  return rounded < kNearest || rounded > kFarthest ? 0.0f : static_cast<float>(rounded);
}

}  // namespace

View Render(const Scene& scene, const CameraModel& camera,
            const Eigen::Isometry3d& world_from_camera) {
  const size_t pixels = static_cast<size_t>(camera.width) * camera.height;
  View view{{camera.width, camera.height, std::vector<float>(pixels, 0.0f)},
            std::vector<int16_t>(pixels, View::kStructure)};
  Painter painter(camera, world_from_camera, view);
  if (scene.walls) painter.Draw(*scene.walls);
  for (const Prism& prism : scene.structure) painter.Draw(prism, View::kStructure);
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    for (const Prism& part : scene.bodies[i].parts) painter.Draw(part, static_cast<int16_t>(i));
  }
  return view;
}

DepthImage WithSensorNoise(const View& view, Random& random) {
  constexpr double kFails = 0.3;
  constexpr double kMixes = 0.25;
  DepthImage noisy = view.depth;
  for (int v = 0; v < noisy.height; ++v) {
    for (int u = 0; u < noisy.width; ++u) {
      float& z = noisy.metres[static_cast<size_t>(v) * noisy.width + u];
      if (z == 0.0f) continue;
      double seen = z;
      if (const std::optional<float> across = DepthAcrossEdge(view.depth, u, v)) {
        if (random.Chance(kFails)) seen = 0.0;
        if (seen > 0.0 && random.Chance(kMixes)) {
          seen += random.Uniform(0.0, 1.0) * (*across - seen);
        }
      }
      z = seen > 0.0 ? Measure(seen, random) : 0.0f;
    }
  }
  return noisy;
}

}  // namespace hypermap::simulation
