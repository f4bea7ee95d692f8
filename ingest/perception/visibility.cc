#include "ingest/perception/visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "map/geometry/convex_hull.h"

namespace hypermap::ingest {
namespace {

// Returns within this height of the plane show the floor. Returns between this and obstacle_low_m
// are too uncertain to be either floor or obstacle, and are ignored.
constexpr float kFloor_m = 0.06f;
// A bearing with less free floor than this counts as not free, metres.
constexpr double kMinDepth_m = 0.05;
// The narrowest fan of returns that is divided into bearings, radians.
constexpr double kMinHalfWidth_rad = 1e-6;

// Ranges on the plane along one bearing, metres.
struct Bearing {
  float nearest_floor = std::numeric_limits<float>::infinity();
  float farthest_floor = 0.0f;
  float obstacle = std::numeric_limits<float>::infinity();

  double begin() const { return nearest_floor; }
  double end() const { return std::min(farthest_floor, obstacle); }
  bool free() const { return end() > begin() + kMinDepth_m; }
};

// The bearings on the plane that returns cover, radians: `half_width` to each side of `axis`.
// at(0) is the left edge, at(1) the right edge.
struct Fan {
  double axis = 0.0;
  double half_width = 0.0;

  double at(double share) const { return axis + half_width * (1.0 - 2.0 * share); }
};

// Returns the pixel of the image that shows the ray of pixel (u, v) of the camera without its
// distortion, or -1 if it is outside the image.
int64_t PixelAlongRay(const CameraModel& camera, int u, int v) {
  if (!camera.distorted()) return int64_t{v} * camera.width + u;
  const Eigen::Vector2d seen =
      Project(camera, {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy});
  const double column = std::round(seen.x());
  const double row = std::round(seen.y());
  if (!(column >= 0.0 && column < camera.width && row >= 0.0 && row < camera.height)) return -1;
  return static_cast<int64_t>(row) * camera.width + static_cast<int64_t>(column);
}

// Returns the angle in [-pi, pi].
double Wrapped(double angle) { return std::remainder(angle, 2.0 * M_PI); }

}  // namespace

Polygon ViewHull(const OrganisedCloud& cloud, const VisibilityOptions& options) {
  std::vector<Point> points;
  // About 4000 points suffice for a hull. The step is odd, because an even one would share factors
  // with the width of most images and sample the same few columns of each row.
  const size_t step = std::max<size_t>(7, cloud.camera.size() / 4001 | 1);
  for (size_t i = 0; i < cloud.camera.size(); i += step) {
    if (!cloud.valid(static_cast<int32_t>(i))) continue;
    // False also for points that are not finite.
    if (!(cloud.camera[i].norm() <= options.max_range_m)) continue;
    const Eigen::Vector3f p = cloud.upright(static_cast<int32_t>(i));
    points.push_back({cloud.foot.x() + p.x(), cloud.foot.y() + p.y()});
  }
  return ConvexHull(std::move(points));
}

Polygon FreeSpace(const OrganisedCloud& cloud, const VisibilityOptions& options) {
  Fan fan;
  // The fan is centred on the mean direction of the returns, not on the optical axis, which has no
  // bearing if the camera looks straight down.
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  const size_t thin = std::max<size_t>(5, cloud.camera.size() / 5003 | 1);
  for (size_t i = 0; i < cloud.camera.size(); i += thin) {
    if (cloud.valid(static_cast<int32_t>(i))) {
      mean += cloud.upright(static_cast<int32_t>(i)).head<2>().normalized();
    }
  }
  if (mean.norm() == 0.0f) return {};
  fan.axis = std::atan2(mean.y(), mean.x());
  for (size_t i = 0; i < cloud.camera.size(); i += thin) {
    if (!cloud.valid(static_cast<int32_t>(i))) continue;
    const Eigen::Vector3f p = cloud.upright(static_cast<int32_t>(i));
    fan.half_width =
        std::max(fan.half_width, std::abs(Wrapped(std::atan2(p.y(), p.x()) - fan.axis)));
  }
  // Returns all around the camera leave no gap at which the fan could begin and end. A fan that is
  // too narrow has no bearings. False also for a width that is not a number.
  if (!(fan.half_width >= kMinHalfWidth_rad && fan.half_width <= 0.45 * M_PI * 2.0)) return {};

  // About 160 columns of the image give every bearing several returns.
  std::vector<Bearing> bearings(options.bearings);
  const int step = std::max(1, cloud.width / 160);
  const auto ahead_x = static_cast<float>(std::cos(fan.axis));
  const auto ahead_y = static_cast<float>(std::sin(fan.axis));
  const auto half_width = static_cast<float>(fan.half_width);
  for (int v = 0; v < cloud.height; v += step) {
    for (int u = 0; u < cloud.width; u += step) {
      const int32_t i = v * cloud.width + u;
      if (!cloud.valid(i)) continue;
      const Eigen::Vector3f p = cloud.upright(static_cast<int32_t>(i));
      const bool floor = std::abs(p.z()) < kFloor_m;
      const bool obstacle = p.z() > options.obstacle_low_m && p.z() < options.obstacle_high_m;
      if (!floor && !obstacle) continue;
      const float range = p.head<2>().norm();
      if (!(range <= options.max_range_m)) continue;
      const float off =
          std::atan2(ahead_x * p.y() - ahead_y * p.x(), ahead_x * p.x() + ahead_y * p.y());
      const float share = 0.5f * (1.0f - off / half_width);
      // Clamped before it is cast: pixels that were not sampled may be far outside of the fan.
      const int k = static_cast<int>(std::clamp(share * static_cast<float>(options.bearings), 0.0f,
                                                static_cast<float>(options.bearings - 1)));
      Bearing& bearing = bearings[k];
      if (floor) {
        bearing.nearest_floor = std::min(bearing.nearest_floor, range);
        bearing.farthest_floor = std::max(bearing.farthest_floor, range);
      } else {
        bearing.obstacle = std::min(bearing.obstacle, range);
      }
    }
  }
  int best_begin = 0;
  int best_end = 0;
  for (int k = 0; k < options.bearings;) {
    if (!bearings[k].free()) {
      ++k;
      continue;
    }
    const int begin = k;
    while (k < options.bearings && bearings[k].free()) ++k;
    if (k - begin > best_end - best_begin) {
      best_begin = begin;
      best_end = k;
    }
  }
  if (best_end - best_begin < 2) return {};
  Ring ring;
  const auto add = [&](int k, double range) {
    const double angle = fan.at((k + 0.5) / options.bearings);
    ring.push_back(
        {cloud.foot.x() + range * std::cos(angle), cloud.foot.y() + range * std::sin(angle)});
  };
  for (int k = best_begin; k < best_end; ++k) add(k, bearings[k].begin());
  for (int k = best_end - 1; k >= best_begin; --k) add(k, bearings[k].end());
  auto polygon = Polygon::Make(std::move(ring));
  return polygon.ok() ? *std::move(polygon) : Polygon();
}

DepthView ThinnedDepth(const OrganisedCloud& cloud, const CameraModel& camera, int stride,
                       const std::vector<const std::vector<uint8_t>*>& masks) {
  DepthView view;
  const int offset = stride / 2;
  view.columns = (cloud.width - offset + stride - 1) / stride;
  view.rows = (cloud.height - offset + stride - 1) / stride;
  view.fx = camera.fx / stride;
  view.fy = camera.fy / stride;
  view.cx = (camera.cx - offset) / stride;
  view.cy = (camera.cy - offset) / stride;
  view.depth_mm.reserve(static_cast<size_t>(view.columns) * view.rows);
  view.owner.assign(static_cast<size_t>(view.columns) * view.rows, 0);
  for (int r = 0; r < view.rows; ++r) {
    for (int c = 0; c < view.columns; ++c) {
      const int64_t pixel = PixelAlongRay(camera, c * stride + offset, r * stride + offset);
      if (pixel < 0) {
        view.depth_mm.push_back(0);
        continue;
      }
      const float mm = 1000.0f * cloud.camera[pixel].z();
      view.depth_mm.push_back(static_cast<uint16_t>(std::min(65535.0f, mm + 0.5f)));
      uint8_t& owner = view.owner[static_cast<size_t>(r) * view.columns + c];
      for (size_t i = 0; i < masks.size(); ++i) {
        if (!(*masks[i])[pixel]) continue;
        owner = owner != 0 || i >= 253 ? DepthView::kSeveral : static_cast<uint8_t>(i + 1);
      }
    }
  }
  return view;
}

}  // namespace hypermap::ingest
