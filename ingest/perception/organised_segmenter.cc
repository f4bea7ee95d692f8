// Segmentation over the organised image. In the order of the work:
//   1. planes that the mask's surroundings lie on (table, floor, wall) are found by RANSAC;
//   2. pixels of the mask that continue such a plane from its border are background, unless the
//      thing itself is as flat as the plane;
//   3. mixed pixels between a near and a far surface are dropped;
//   4. so are parts of things that touch, as far as the crease between them;
//   5. what is left is joined over the image where depth goes on without a step; the component that
//      lies deepest in the mask is the thing, with all others that are near it in depth.
#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/perception/depth_noise.h"
#include "ingest/perception/mask_window.h"
#include "ingest/perception/neighbours.h"
#include "ingest/perception/segmenter.h"

namespace hypermap::ingest {
namespace {

constexpr int kMargin_px = 10;
// Larger masks are thinned first, in wider images sooner: what a pixel is at this width shows the
// shape of such a thing well enough.
constexpr int kMaxPixels = 60000;
constexpr int kMaxPixelsOfFine = 7000;
constexpr int kPlainWidth_px = 320;
constexpr size_t kMaxRingPoints = 300;
constexpr int kMaxPlanes = 3;
constexpr int kRansacRounds = 48;
constexpr int kMinCrossings = 3;
constexpr float kLeastTolerance_m = 0.004f;

struct Plane {
  Eigen::Vector3f normal;
  float offset = 0.0f;  // normal . p = offset
};

// Whether the point lies on the plane: within two and a half sigmas of depth, seen across the
// plane, but never less than what calibration leaves.
bool LiesOn(const Plane& plane, const Eigen::Vector3f& p) {
  const float along_normal = plane.normal.dot(p);
  const float distance = std::abs(along_normal - plane.offset);
  if (distance < kLeastTolerance_m) return true;
  const float most = 2.5f * DepthSigma(p.z());
  if (distance >= most) return false;
  return distance * p.norm() < most * std::max(0.3f * p.norm(), std::abs(along_normal));
}

// The same numbers on every run.
class Lottery {
 public:
  size_t Draw(size_t n) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<size_t>((state_ >> 33) % n);
  }

 private:
  uint64_t state_ = 0x9e3779b97f4a7c15u;
};

Plane LeastSquares(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<float>(points.size());
  Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(scatter);
  Plane plane;
  plane.normal = solver.eigenvectors().col(0).normalized();
  plane.offset = plane.normal.dot(mean);
  return plane;
}

// The plane that most points lie on; false when it has fewer than `at_least`. Takes its points out.
bool TakePlane(std::vector<Eigen::Vector3f>* points, size_t at_least, Lottery* lottery,
               Plane* best) {
  size_t best_count = 0;
  for (int round = 0; round < kRansacRounds; ++round) {
    const Eigen::Vector3f& a = (*points)[lottery->Draw(points->size())];
    const Eigen::Vector3f& b = (*points)[lottery->Draw(points->size())];
    const Eigen::Vector3f& c = (*points)[lottery->Draw(points->size())];
    const Eigen::Vector3f cross = (b - a).cross(c - a);
    if (cross.norm() < 1e-4f) continue;
    const Plane plane{cross.normalized(), cross.normalized().dot(a)};
    size_t count = 0;
    for (const auto& p : *points) count += LiesOn(plane, p);
    if (count > best_count) {
      best_count = count;
      *best = plane;
    }
  }
  if (best_count < at_least) return false;
  std::vector<Eigen::Vector3f> on;
  for (const auto& p : *points) {
    if (LiesOn(*best, p)) on.push_back(p);
  }
  *best = LeastSquares(on);
  std::erase_if(*points, [&](const auto& p) { return LiesOn(*best, p); });
  return true;
}

class OrganisedSegmenter : public Segmenter {
 public:
  std::vector<int32_t> Segment(const OrganisedCloud& cloud,
                               const std::vector<uint8_t>& mask) const override;
};

// One mask on its way.
class Segmentation {
 public:
  Segmentation(const OrganisedCloud& cloud, const MaskWindow& window)
      : cloud_(cloud), window_(window), kept_(window.inside) {
    pixel_.reserve(kept_.size());
    for (int v = 0; v < window.height; ++v) {
      for (int u = 0; u < window.width; ++u) {
        pixel_.push_back(window.image_index(u, v, cloud.width));
      }
    }
    for (int i = 0; i < static_cast<int>(kept_.size()); ++i) {
      if (kept_[i] && !cloud_.valid(Pixel(i))) kept_[i] = 0;
    }
  }

  void DropBackgroundPlanes();
  void DropMixedPixels();
  bool TouchesOutside() const;
  void DropTouching();
  // Leaves the component that is the thing, and those near it.
  void KeepNearComponents();
  // The pixels of the mask that are kept, or lie beside a kept one on the same surface.
  std::vector<int32_t> Pixels(const std::vector<uint8_t>& mask) const;

 private:
  int32_t Pixel(int i) const { return pixel_[i]; }
  float Depth(int i) const { return cloud_.camera[Pixel(i)].z(); }
  std::vector<Eigen::Vector3f> RingPoints() const;
  // Of two pixels of the image that are neighbours in the window.
  bool SameSurface(int32_t a, int32_t b) const {
    return DepthGoesOn(cloud_.camera[a].z(), cloud_.camera[b].z(), window_.stride);
  }

  const OrganisedCloud& cloud_;
  const MaskWindow& window_;
  std::vector<uint8_t> kept_;
  std::vector<int32_t> pixel_;  // of the image, for each of the window
};

std::vector<Eigen::Vector3f> Segmentation::RingPoints() const {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < static_cast<int>(kept_.size()); ++i) {
    if (window_.inside[i] || window_.depth[i] * window_.stride > kMargin_px) continue;
    if (cloud_.valid(Pixel(i))) points.push_back(cloud_.camera[Pixel(i)]);
  }
  if (points.size() <= kMaxRingPoints) return points;
  std::vector<Eigen::Vector3f> some;
  for (size_t k = 0; k < kMaxRingPoints; ++k) {
    some.push_back(points[k * points.size() / kMaxRingPoints]);
  }
  return some;
}

void Segmentation::DropBackgroundPlanes() {
  std::vector<Eigen::Vector3f> ring = RingPoints();
  const size_t at_least = std::max<size_t>(12, ring.size() / 8);
  Lottery lottery;
  for (int k = 0; k < kMaxPlanes && ring.size() >= at_least; ++k) {
    Plane plane;
    if (!TakePlane(&ring, at_least, &lottery, &plane)) return;
    int on = 0;
    int off = 0;
    int64_t depth_on = 0;
    int64_t depth_off = 0;
    std::vector<int> background;
    for (int i = 0; i < static_cast<int>(kept_.size()); ++i) {
      if (!kept_[i]) continue;
      const Eigen::Vector3f& p = cloud_.camera[Pixel(i)];
      if (LiesOn(plane, p)) {
        background.push_back(i);
        depth_on += window_.depth[i];
        ++on;
      } else {
        depth_off += window_.depth[i];
        ++off;
      }
    }
    if (on == 0) continue;
    // A flat thing, or one whose own face goes on beyond a mask that is too small, lies on the
    // plane with its middle; background does so with its rim.
    const bool rim =
        off > 0 && static_cast<double>(depth_on) / on < 0.8 * static_cast<double>(depth_off) / off;
    if (!rim || off < 0.4 * (on + off)) continue;
    for (const int i : background) kept_[i] = 0;
  }
}

void Segmentation::DropMixedPixels() {
  std::vector<int> mixed;
  const int w = window_.width;
  const int h = window_.height;
  for (int v = 1; v + 1 < h; ++v) {
    for (int u = 1; u + 1 < w; ++u) {
      const int i = window_.index(u, v);
      if (!kept_[i]) continue;
      const float z = Depth(i);
      const float step = 0.015f + 3.0f * DepthSigma(z);
      for (const auto& [a, b] : {std::pair(i - 1, i + 1), std::pair(i - w, i + w)}) {
        if (!cloud_.valid(Pixel(a)) || !cloud_.valid(Pixel(b))) continue;
        const float da = Depth(a) - z;
        const float db = Depth(b) - z;
        if (da * db < 0.0f && std::min(std::abs(da), std::abs(db)) > step) {
          mixed.push_back(i);
          break;
        }
      }
    }
  }
  for (const int i : mixed) kept_[i] = 0;
}

// Whether a surface goes on from the mask to what is beside it.
bool Segmentation::TouchesOutside() const {
  const int w = window_.width;
  const int h = window_.height;
  int crossings = 0;
  for (int i = 0; i < static_cast<int>(kept_.size()); ++i) {
    if (!kept_[i] || window_.depth[i] != 1) continue;
    const std::array<std::pair<int, bool>, 4> around = {
        {{i - 1, i % w > 0}, {i + 1, i % w + 1 < w}, {i - w, i / w > 0}, {i + w, i / w + 1 < h}}};
    for (const auto& [j, there] : around) {
      if (!there || window_.inside[j] || !cloud_.valid(Pixel(j))) continue;
      if (SameSurface(Pixel(i), Pixel(j)) && ++crossings >= kMinCrossings) return true;
    }
  }
  return false;
}

void Segmentation::DropTouching() {
  if (!TouchesOutside()) return;
  std::vector<float> depth(kept_.size());
  for (int i = 0; i < static_cast<int>(depth.size()); ++i) depth[i] = std::max(0.0f, Depth(i));
  DropNeighbours(window_, depth, kMargin_px, &kept_);
}

struct Component {
  std::vector<int> pixels;
  int64_t core = 0;  // sum of how deep its pixels lie in the mask
  float near = 0.0f;
  float far = 0.0f;
};

void Segmentation::KeepNearComponents() {
  std::vector<uint8_t> seen(kept_.size(), 0);
  std::vector<Component> components;
  const int w = window_.width;
  const int h = window_.height;
  for (int start = 0; start < static_cast<int>(kept_.size()); ++start) {
    if (!kept_[start] || seen[start]) continue;
    Component component;
    component.near = component.far = Depth(start);
    component.pixels.push_back(start);
    seen[start] = 1;
    for (size_t next = 0; next < component.pixels.size(); ++next) {
      const int i = component.pixels[next];
      component.core += window_.depth[i];
      component.near = std::min(component.near, Depth(i));
      component.far = std::max(component.far, Depth(i));
      const int u = i % w;
      const std::array<std::pair<int, bool>, 4> around = {
          {{i - 1, u > 0}, {i + 1, u + 1 < w}, {i - w, i >= w}, {i + w, i + w < w * h}}};
      for (const auto& [j, there] : around) {
        if (!there || !kept_[j] || seen[j] || !SameSurface(Pixel(i), Pixel(j))) continue;
        seen[j] = 1;
        component.pixels.push_back(j);
      }
    }
    components.push_back(std::move(component));
  }
  if (components.empty()) return;
  const auto main =
      std::max_element(components.begin(), components.end(),
                       [](const Component& a, const Component& b) { return a.core < b.core; });
  const float reach = 0.05f + 3.0f * DepthSigma(main->near);
  const size_t at_least = std::max<size_t>(3, main->pixels.size() / 100);
  for (const Component& component : components) {
    if (&component == &*main) continue;
    if (component.pixels.size() >= at_least && component.near <= main->far + reach &&
        component.far >= main->near - reach) {
      continue;
    }
    for (const int i : component.pixels) kept_[i] = 0;
  }
}

std::vector<int32_t> Segmentation::Pixels(const std::vector<uint8_t>& mask) const {
  std::vector<int32_t> pixels;
  const int stride = window_.stride;
  const int u_end = std::min(cloud_.width, window_.u0 + window_.width * stride);
  const int v_end = std::min(cloud_.height, window_.v0 + window_.height * stride);
  for (int v = window_.v0; v < v_end; ++v) {
    for (int u = window_.u0; u < u_end; ++u) {
      const int i = window_.index((u - window_.u0) / stride, (v - window_.v0) / stride);
      const int32_t pixel = v * cloud_.width + u;
      if (!kept_[i] || !mask[pixel] || !cloud_.valid(pixel)) continue;
      if (stride > 1 && !SameSurface(pixel, Pixel(i))) continue;
      pixels.push_back(pixel);
    }
  }
  return pixels;
}

std::vector<int32_t> OrganisedSegmenter::Segment(const OrganisedCloud& cloud,
                                                 const std::vector<uint8_t>& mask) const {
  const int thin = std::max(1, cloud.width / kPlainWidth_px);
  MaskWindow window =
      CutOut(mask, cloud.width, cloud.height, kMargin_px, thin > 1 ? kMaxPixelsOfFine : kMaxPixels);
  if (window.empty()) return {};
  MeasureDepth(&window);
  Segmentation segmentation(cloud, window);
  segmentation.DropBackgroundPlanes();
  segmentation.DropMixedPixels();
  segmentation.DropTouching();
  segmentation.KeepNearComponents();
  return segmentation.Pixels(mask);
}

}  // namespace

std::unique_ptr<Segmenter> MakeOrganisedSegmenter() {
  return std::make_unique<OrganisedSegmenter>();
}

}  // namespace hypermap::ingest
