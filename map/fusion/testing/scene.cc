#include "map/fusion/testing/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "map/geometry/convex_hull.h"
#include "map/observations/range_weight.h"

namespace hypermap::fusion {
namespace {

constexpr int kColumns = 80;
constexpr int kRows = 60;
constexpr double kFocal_px = 65.0;
constexpr double kMaxDepth_m = 8.0;

Eigen::Isometry3d PoseOf(const SceneCamera& camera) {
  const double c = std::cos(camera.pitch_rad);
  const double s = std::sin(camera.pitch_rad);
  const Eigen::Vector3d forward(std::cos(camera.yaw_rad) * c, std::sin(camera.yaw_rad) * c, -s);
  const Eigen::Vector3d right(std::sin(camera.yaw_rad), -std::cos(camera.yaw_rad), 0.0);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = Eigen::Vector3d(camera.x, camera.y, camera.height_m);
  return pose;
}

// Returns where `ray` enters the box, in multiples of `ray`; infinity if it misses (slab method).
double Enter(const SceneBox& box, const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d low(box.footprint.min.x, box.footprint.min.y, box.height.low_m);
  const Eigen::Vector3d high(box.footprint.max.x, box.footprint.max.y, box.height.high_m);
  double begin = 0.0;
  double end = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    double a = (low[axis] - eye[axis]) / ray[axis];
    double b = (high[axis] - eye[axis]) / ray[axis];
    if (a > b) std::swap(a, b);
    begin = std::max(begin, a);
    end = std::min(end, b);
  }
  return begin < end ? begin : std::numeric_limits<double>::infinity();
}

}  // namespace

Observation Observe(const std::vector<SceneBox>& scene, const SceneCamera& camera, int64_t sequence,
                    const SceneDetector& detector, const std::string& robot) {
  Observation observation;
  observation.robot = robot;
  observation.sequence = sequence;
  observation.stamp = absl::FromUnixMillis(1000000000000 + 200 * sequence);
  SceneCamera claimed = camera;
  claimed.x += detector.pose_error_x;
  claimed.y += detector.pose_error_y;
  observation.pose.frame_from_camera = PoseOf(claimed);
  observation.pose.covariance = Eigen::Vector3d(0.0025, 0.0025, 0.0003).asDiagonal();

  const Eigen::Isometry3d pose = PoseOf(camera);
  DepthView view{kColumns, kRows, kFocal_px, kFocal_px, 0.5 * (kColumns - 1), 0.5 * (kRows - 1)};
  std::vector<int> seen(static_cast<size_t>(kColumns) * kRows, -1);
  std::map<int, std::vector<Point>> points;
  std::vector<Point> all;
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < kColumns; ++u) {
      const Eigen::Vector3d ray =
          pose.linear() * Eigen::Vector3d((u - view.cx) / view.fx, (v - view.cy) / view.fy, 1.0);
      double depth = ray.z() < 0.0 ? camera.height_m / -ray.z() : kMaxDepth_m + 1.0;
      int which = -1;
      for (int i = 0; i < static_cast<int>(scene.size()); ++i) {
        const double at = Enter(scene[i], pose.translation(), ray);
        if (at < depth) {
          depth = at;
          which = i;
        }
      }
      view.depth_mm.push_back(
          depth > kMaxDepth_m ? 0 : static_cast<uint16_t>(std::lround(1000.0 * depth)));
      if (depth > kMaxDepth_m) which = -1;
      seen[static_cast<size_t>(v) * kColumns + u] = which;
      if (depth > kMaxDepth_m) continue;
      const Eigen::Vector3d p = pose.translation() + depth * ray;
      const Point claimed_at{p.x() + detector.pose_error_x, p.y() + detector.pose_error_y};
      all.push_back(claimed_at);
      if (which >= 0) points[which].push_back(claimed_at);
    }
  }
  observation.view_hull = ConvexHull(all);

  view.owner.assign(seen.size(), 0);
  for (const auto& [which, at] : points) {
    if (std::count(detector.missed.begin(), detector.missed.end(), which) || at.size() < 4) {
      continue;
    }
    Detection detection;
    detection.hull = ConvexHull(at);
    if (detection.hull.empty()) continue;
    const auto called = detector.called.find(which);
    detection.scores[called == detector.called.end() ? scene[which].label : called->second] =
        detector.score;
    std::set<std::pair<int32_t, int32_t>> cells;
    for (const Point& p : at) {
      cells.emplace(static_cast<int32_t>(std::floor(p.y / 0.02)),
                    static_cast<int32_t>(std::floor(p.x / 0.02)));
    }
    detection.cells.resolution_m = 0.02;
    for (const auto& [row, col] : cells) detection.cells.spans.push_back({row, col, col + 1});
    detection.height = scene[which].height;
    detection.num_points = static_cast<int32_t>(at.size());
    const Point middle = Centroid(detection.hull);
    detection.range_m = std::hypot(middle.x - claimed.x, middle.y - claimed.y);
    detection.weight = RangeWeight(detection.range_m);
    observation.detections.push_back(std::move(detection));
    for (size_t i = 0; i < seen.size(); ++i) {
      if (seen[i] == which) {
        view.owner[i] = static_cast<uint8_t>(observation.detections.size());
      }
    }
  }
  observation.depth = std::move(view);
  return observation;
}

}  // namespace hypermap::fusion
