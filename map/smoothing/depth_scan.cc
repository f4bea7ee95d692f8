#include "map/smoothing/depth_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "map/observations/view_frame.h"

namespace hypermap::smoothing {
namespace {

// Sensors measure badly what is nearer; beyond the farthest, depth noise is 6 cm.
constexpr float kNearest_m = 0.3f;
constexpr float kFarthest_m = 6.0f;
// What is lower may be floor.
constexpr float kLowest_m = 0.08f;
// Neighbours whose depths differ by a larger share are on different surfaces.
constexpr float kSameSurface = 0.1f;
// A surface is upright if its normal is within 17 degrees of the plane.
constexpr float kMaxNormalZ = 0.3f;
// Behind an edge, depth is larger by this share, and by at least this much.
constexpr float kBehindEdge = 0.12f;
constexpr float kBehindEdge_m = 0.2f;
// An edge lies anywhere in its pixel.
constexpr float kEdgeSigma_pixels = 0.4f;
// How far an edge is looked for, in pixels.
constexpr int kEdgeReachAcross = 4;
constexpr int kEdgeReachAlong = 1;

// The noise of depth (Nguyen, Izadi, Lovell 2012), and what surfaces deviate between pixels.
float SurfaceSigma(float depth_m) {
  const float beyond = depth_m - 0.4f;
  return 0.003f + 0.0019f * beyond * beyond;
}

// Whether a point can be from a camera with an aperture of up to 150 degrees: calibrations that
// make points anywhere else, or nowhere, are wrong.
bool IsInReach(const Eigen::Vector3f& position) {
  return position.squaredNorm() < 16.0f * kFarthest_m * kFarthest_m;
}

bool IsMeasured(float depth_m) { return depth_m >= kNearest_m && depth_m <= kFarthest_m; }

}  // namespace

DepthScan::DepthScan(const Observation& observation)
    : columns_(observation.depth->columns),
      rows_(observation.depth->rows),
      focal_(static_cast<float>(observation.depth->fx), static_cast<float>(observation.depth->fy)),
      centre_(static_cast<float>(observation.depth->cx), static_cast<float>(observation.depth->cy)),
      view_from_camera_(ViewFromCamera(observation.pose.frame_from_camera.linear().row(2),
                                       observation.pose.frame_from_camera.translation().z())
                            .cast<float>()),
      camera_from_view_(view_from_camera_.inverse()) {
  surface_of_.assign(observation.depth->depth_mm.size(), -1);
  FindSurface(*observation.depth);
  FindEdges(*observation.depth);
  surface_.shrink_to_fit();
  edges_.shrink_to_fit();
}

Eigen::Vector3f DepthScan::InCamera(const DepthView& view, const Pixel& pixel) const {
  const float depth = 0.001f * static_cast<float>(view.depth_mm[IndexOf(pixel)]);
  return {depth * (static_cast<float>(pixel.u) - centre_.x()) / focal_.x(),
          depth * (static_cast<float>(pixel.v) - centre_.y()) / focal_.y(), depth};
}

void DepthScan::FindSurface(const DepthView& view) {
  for (int v = 1; v + 1 < rows_; ++v) {
    for (int u = 1; u + 1 < columns_; ++u) {
      const Eigen::Vector3f here = InCamera(view, {u, v});
      if (!IsMeasured(here.z())) continue;
      const Eigen::Vector3f left = InCamera(view, {u - 1, v});
      const Eigen::Vector3f right = InCamera(view, {u + 1, v});
      const Eigen::Vector3f above = InCamera(view, {u, v - 1});
      const Eigen::Vector3f below = InCamera(view, {u, v + 1});
      const Eigen::Vector4f around(left.z(), right.z(), above.z(), below.z());
      if ((around.array() - here.z()).abs().maxCoeff() > kSameSurface * here.z()) continue;
      const Eigen::Vector3f position = view_from_camera_ * here;
      if (!IsInReach(position) || position.z() < kLowest_m) continue;
      const Eigen::Vector3f normal =
          view_from_camera_.linear() * (right - left).cross(below - above);
      const float length = normal.norm();
      if (!(length > 0.0f && std::isfinite(length))) continue;
      if (std::abs(normal.z()) > kMaxNormalZ * length) continue;
      Eigen::Vector2f on_plane = normal.head<2>().normalized();
      if (on_plane.dot(position.head<2>()) > 0.0f) on_plane = -on_plane;
      surface_of_[IndexOf({u, v})] = static_cast<int32_t>(surface_.size());
      surface_.push_back({position, on_plane, SurfaceSigma(here.z())});
    }
  }
}

void DepthScan::FindEdges(const DepthView& view) {
  for (int v = 0; v < rows_; ++v) {
    row_begin_.push_back(static_cast<int32_t>(edges_.size()));
    for (int u = 1; u + 1 < columns_; ++u) {
      const Eigen::Vector3f here = InCamera(view, {u, v});
      const float depth = here.z();
      if (!IsMeasured(depth)) continue;
      const Eigen::Vector3f position = view_from_camera_ * here;
      if (!IsInReach(position) || position.z() < kLowest_m) continue;
      for (const int outwards : {-1, 1}) {
        const float beyond = InCamera(view, {u + outwards, v}).z();
        const float within = InCamera(view, {u - outwards, v}).z();
        if (!(beyond > depth + std::max(kBehindEdge_m, kBehindEdge * depth))) continue;
        if (!(within > 0.0f && std::abs(within - depth) < kSameSurface * depth)) continue;
        edges_.push_back({position, 0.005f + kEdgeSigma_pixels * depth / focal_.x(),
                          static_cast<int16_t>(u), outwards > 0});
      }
    }
  }
  row_begin_.push_back(static_cast<int32_t>(edges_.size()));
}

int64_t DepthScan::bytes() const {
  return static_cast<int64_t>(sizeof *this + surface_.capacity() * sizeof(SurfacePoint) +
                              edges_.capacity() * sizeof(EdgePoint) +
                              (surface_of_.size() + row_begin_.size()) * sizeof(int32_t));
}

bool DepthScan::PixelOf(const Eigen::Vector3f& place, Pixel* pixel) const {
  const Eigen::Vector3f p = camera_from_view_ * place;
  if (!(p.z() > 0.1f)) return false;
  const float u = focal_.x() * p.x() / p.z() + centre_.x();
  const float v = focal_.y() * p.y() / p.z() + centre_.y();
  // False also for numbers that are not finite.
  if (!(std::abs(u) < 1e6f && std::abs(v) < 1e6f)) return false;
  *pixel = {static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v))};
  return true;
}

const SurfacePoint* DepthScan::SurfaceAt(const Eigen::Vector3f& place) const {
  Pixel pixel;
  if (!PixelOf(place, &pixel) || !IsInside(pixel)) return nullptr;
  const int32_t index = surface_of_[IndexOf(pixel)];
  return index < 0 ? nullptr : &surface_[static_cast<size_t>(index)];
}

const EdgePoint* DepthScan::EdgeNear(const Eigen::Vector3f& place, bool is_right) const {
  Pixel pixel;
  if (!PixelOf(place, &pixel)) return nullptr;
  const EdgePoint* nearest = nullptr;
  float least = std::numeric_limits<float>::infinity();
  const int first_row = std::max(0, pixel.v - kEdgeReachAlong);
  const int last_row = std::min(rows_ - 1, pixel.v + kEdgeReachAlong);
  for (int v = first_row; v <= last_row; ++v) {
    for (int32_t i = row_begin_[v]; i < row_begin_[v + 1]; ++i) {
      const EdgePoint& edge = edges_[static_cast<size_t>(i)];
      if (edge.is_right != is_right || std::abs(edge.column - pixel.u) > kEdgeReachAcross) continue;
      const float apart = (edge.position - place).squaredNorm();
      if (apart < least) {
        least = apart;
        nearest = &edge;
      }
    }
  }
  return nearest;
}

}  // namespace hypermap::smoothing
