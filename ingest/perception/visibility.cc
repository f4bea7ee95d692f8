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
// The fans of returns that are divided into bearings, radians. Returns all around the camera leave
// no gap at which a fan could begin and end, so that it must be narrower than a full turn.
constexpr double kMinHalfWidth_rad = 1e-6;
constexpr double kMaxHalfWidth_rad = 0.9 * M_PI;
// About so many pixels suffice for the hull of an image, and for the fan of its returns.
constexpr size_t kHullSamples = 4001;
constexpr size_t kFanSamples = 5003;
// About this many columns of the image are used. They give each bearing several returns.
constexpr int kColumns = 160;

// Ranges on the plane along one bearing, metres.
struct Bearing {
  float nearest_floor = std::numeric_limits<float>::infinity();
  float farthest_floor = 0.0f;
  float obstacle = std::numeric_limits<float>::infinity();

  void Add(float range, bool is_floor) {
    if (is_floor) {
      nearest_floor = std::min(nearest_floor, range);
      farthest_floor = std::max(farthest_floor, range);
    } else {
      obstacle = std::min(obstacle, range);
    }
  }
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
  // False also for a width that is not a number.
  bool usable() const { return half_width >= kMinHalfWidth_rad && half_width <= kMaxHalfWidth_rad; }
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

// Returns the step by which about `samples` pixels are visited, at least `min_step`. It is odd,
// because an even one would share factors with the width of most images and sample the same few
// columns of each row. REQUIRES: min_step is odd.
size_t StepOf(const OrganisedCloud& cloud, size_t min_step, size_t samples) {
  return std::max(min_step, cloud.camera.size() / samples | 1);
}

// Returns the angle in [-pi, pi].
double Wrapped(double angle) { return std::remainder(angle, 2.0 * M_PI); }

// Returns the fan of all returns, which has no width if there are none. It is centred on the mean
// direction of the returns, not on the optical axis, which has no bearing if the camera looks
// straight down.
Fan FanOf(const OrganisedCloud& cloud) {
  Fan fan;
  const size_t step = StepOf(cloud, 5, kFanSamples);
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  for (size_t i = 0; i < cloud.camera.size(); i += step) {
    if (cloud.valid(static_cast<int32_t>(i))) {
      mean += cloud.upright(static_cast<int32_t>(i)).head<2>().normalized();
    }
  }
  if (mean.norm() == 0.0f) return fan;
  fan.axis = std::atan2(mean.y(), mean.x());
  for (size_t i = 0; i < cloud.camera.size(); i += step) {
    if (!cloud.valid(static_cast<int32_t>(i))) continue;
    const Eigen::Vector3f p = cloud.upright(static_cast<int32_t>(i));
    fan.half_width =
        std::max(fan.half_width, std::abs(Wrapped(std::atan2(p.y(), p.x()) - fan.axis)));
  }
  return fan;
}

// Returns the ranges of floor and obstacles on each of options.bearings, from left to right.
std::vector<Bearing> Sweep(const OrganisedCloud& cloud, const Fan& fan,
                           const VisibilityOptions& options) {
  std::vector<Bearing> bearings(options.bearings);
  const int step = std::max(1, cloud.width / kColumns);
  const auto ahead_x = static_cast<float>(std::cos(fan.axis));
  const auto ahead_y = static_cast<float>(std::sin(fan.axis));
  const auto half_width = static_cast<float>(fan.half_width);
  for (int v = 0; v < cloud.height; v += step) {
    for (int u = 0; u < cloud.width; u += step) {
      const int32_t i = v * cloud.width + u;
      if (!cloud.valid(i)) continue;
      const Eigen::Vector3f p = cloud.upright(i);
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
      bearings[k].Add(range, floor);
    }
  }
  return bearings;
}

// Returns the first of the widest runs of free bearings, [begin, end). Empty if none is free.
std::pair<int, int> WidestFreeRun(const std::vector<Bearing>& bearings) {
  const int size = static_cast<int>(bearings.size());
  std::pair<int, int> widest = {0, 0};
  int begin = 0;
  for (int k = 0; k < size; ++k) {
    if (!bearings[k].free()) {
      begin = k + 1;
    } else if (k + 1 - begin > widest.second - widest.first) {
      widest = {begin, k + 1};
    }
  }
  return widest;
}

}  // namespace

Polygon ViewHull(const OrganisedCloud& cloud, const VisibilityOptions& options) {
  std::vector<Point> points;
  const size_t step = StepOf(cloud, 7, kHullSamples);
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
  const Fan fan = FanOf(cloud);
  if (!fan.usable()) return {};
  const std::vector<Bearing> bearings = Sweep(cloud, fan, options);
  const auto [begin, end] = WidestFreeRun(bearings);
  if (end - begin < 2) return {};
  Ring ring;
  const auto add = [&](int k, double range) {
    const double angle = fan.at((k + 0.5) / options.bearings);
    ring.push_back(
        {cloud.foot.x() + range * std::cos(angle), cloud.foot.y() + range * std::sin(angle)});
  };
  for (int k = begin; k < end; ++k) add(k, bearings[k].begin());
  for (int k = end - 1; k >= begin; --k) add(k, bearings[k].end());
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
