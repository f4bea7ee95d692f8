// Segmentation on the organised image, whose neighbourhoods need no search tree. The steps:
//   1. RANSAC finds the planes that the mask's surroundings lie on (table, floor, wall).
//   2. Pixels at the mask's rim that lie on such a plane are background, unless the object itself
//      is as flat as the plane.
//   3. Mixed pixels between a near and a far surface are dropped.
//   4. Parts of touching things are dropped up to the crease between them and the object.
//   5. The remaining pixels are joined where depth continues without a step. The component that
//      lies deepest in the mask is the object, together with all others near it in depth.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/cancellation/cancellation.h"
#include "ingest/perception/components.h"
#include "ingest/perception/depth_noise.h"
#include "ingest/perception/mask_window.h"
#include "ingest/perception/neighbours.h"
#include "ingest/perception/segmenter.h"

namespace hypermap::ingest {
namespace {

// Width of the ring around the mask that is searched for background planes and touching things.
constexpr int kMargin_px = 10;
// Masks with more pixels than this are thinned: kMaxPixelsOfFine in images at least twice as wide
// as kPlainWidth_px, where fewer pixels show the shape of a large object well enough, and
// kMaxPixels in others.
constexpr int kMaxPixels = 60000;
constexpr int kMaxPixelsOfFine = 7000;
constexpr int kPlainWidth_px = 320;
// Each round of RANSAC tests all points of the ring, so that this bounds the cost of a plane.
constexpr size_t kMaxRingPoints = 300;
// Enough for a table, the floor and a wall.
constexpr int kMaxPlanes = 3;
// 48 draws of three points miss a plane that holds half of the ring in (1 - 0.5^3)^48 = 0.2 % of
// the cases.
constexpr int kRansacRounds = 48;
// Places where a surface must cross the mask's border before touching things are looked for.
constexpr int kMinCrossings = 3;
// Tolerance of planes at short range, where errors of calibration exceed depth noise.
constexpr float kLeastTolerance_m = 0.004f;

struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float offset = 0.0f;  // Points p of the plane have normal . p = offset.
};

// Points as a structure of arrays, with their tolerances precomputed, so that the compiler
// vectorizes the loops below.
class Points {
 public:
  void Reserve(size_t n) {
    for (auto* values : {&x_, &y_, &z_, &range_, &reach_}) values->reserve(n);
  }

  void Add(const Eigen::Vector3f& p) {
    x_.push_back(p.x());
    y_.push_back(p.y());
    z_.push_back(p.z());
    range_.push_back(p.norm());
    reach_.push_back(2.5f * DepthSigma(p.z()));
  }

  size_t size() const { return x_.size(); }
  Eigen::Vector3f operator[](size_t i) const { return {x_[i], y_[i], z_[i]}; }

  // Returns whether point i lies on the plane, within two and a half sigmas of depth. An error of
  // depth moves a point along its ray, so that across the plane it counts by the cosine of the
  // angle between ray and normal, which is taken as at least 0.3. The tolerance is never less than
  // kLeastTolerance_m.
  bool LiesOn(const Plane& plane, size_t i) const {
    const float along_normal =
        plane.normal.x() * x_[i] + plane.normal.y() * y_[i] + plane.normal.z() * z_[i];
    const float distance = std::abs(along_normal - plane.offset);
    const float leaning = distance * range_[i];
    // Without branches, so that the loops over all points are vectorized.
    const int is_near = distance < kLeastTolerance_m;
    const int is_in_reach = distance < reach_[i];
    const int leans_little = leaning < reach_[i] * 0.3f * range_[i];
    const int faces_camera = leaning < reach_[i] * std::abs(along_normal);
    return (is_near | (is_in_reach & (leans_little | faces_camera))) != 0;
  }

  size_t CountOn(const Plane& plane) const {
    int count = 0;
    for (size_t i = 0; i < size(); ++i) count += LiesOn(plane, i);
    return count;
  }

  std::vector<uint8_t> On(const Plane& plane) const {
    std::vector<uint8_t> on(size());
    for (size_t i = 0; i < size(); ++i) on[i] = LiesOn(plane, i);
    return on;
  }

 private:
  std::vector<float> x_;
  std::vector<float> y_;
  std::vector<float> z_;
  std::vector<float> range_;  // Distance from the camera, metres.
  std::vector<float> reach_;  // Two and a half sigmas of depth, metres.
};

// Linear congruential generator with a fixed seed, for RANSAC. A frame must always give the same
// observation, whichever worker handles it, so each mask starts from the same numbers.
class Sampler {
 public:
  size_t Draw(size_t n) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<size_t>((state_ >> 33) % n);
  }

 private:
  uint64_t state_ = 0x9e3779b97f4a7c15u;
};

// Returns the plane with the least sum of squared distances: its normal is the direction in which
// the points scatter least.
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

// Finds the plane that most points lie on, by RANSAC and a final fit to its points, and removes
// those points from `points`. Returns false, and leaves `points`, if it has fewer than `at_least`.
bool TakePlane(Points* points, size_t at_least, Sampler* sampler, Plane* best) {
  size_t best_count = 0;
  for (int round = 0; round < kRansacRounds; ++round) {
    const Eigen::Vector3f a = (*points)[sampler->Draw(points->size())];
    const Eigen::Vector3f b = (*points)[sampler->Draw(points->size())];
    const Eigen::Vector3f c = (*points)[sampler->Draw(points->size())];
    const Eigen::Vector3f cross = (b - a).cross(c - a);
    // A point drawn twice, or a triangle below half a square centimetre, fixes no plane.
    if (cross.norm() < 1e-4f) continue;
    const Plane plane{cross.normalized(), cross.normalized().dot(a)};
    const size_t count = points->CountOn(plane);
    if (count > best_count) {
      best_count = count;
      *best = plane;
    }
  }
  if (best_count < at_least) return false;
  std::vector<Eigen::Vector3f> on;
  for (size_t i = 0; i < points->size(); ++i) {
    if (points->LiesOn(*best, i)) on.push_back((*points)[i]);
  }
  *best = LeastSquares(on);
  Points rest;
  for (size_t i = 0; i < points->size(); ++i) {
    if (!points->LiesOn(*best, i)) rest.Add((*points)[i]);
  }
  *points = std::move(rest);
  return true;
}

class OrganisedSegmenter : public Segmenter {
 public:
  std::vector<int32_t> Segment(const OrganisedCloud& cloud,
                               const std::vector<uint8_t>& mask) const override;
  // A mask of few pixels may have a window of the whole image.
  int bytes_per_pixel() const override { return 40; }
};

// The segmentation of one mask. Each step clears pixels of kept_.
class Segmentation {
 public:
  Segmentation(const OrganisedCloud& cloud, const MaskWindow& window)
      : cloud_(cloud), window_(window), kept_(window.inside), depth_(kept_.size()) {
    for (int v = 0; v < window.height; ++v) {
      const Eigen::Vector3f* row = cloud.camera.data() + window.image_index(0, v, cloud.width);
      float* out = depth_.data() + window.index(0, v);
      for (int u = 0; u < window.width; ++u) {
        out[u] = std::max(0.0f, row[static_cast<ptrdiff_t>(u) * window.stride].z());
      }
    }
    for (size_t i = 0; i < kept_.size(); ++i) kept_[i] &= depth_[i] > 0.0f;
  }

  void DropBackgroundPlanes();
  void DropMixedPixels();
  bool TouchesOutside() const;
  void DropTouching();
  // Keeps the component that is the object, and components near it in depth.
  void KeepNearComponents();
  // Returns the image's pixels of the mask that the kept pixels stand for. If the window is
  // thinned, these are the pixels of their blocks that lie on the same surface.
  std::vector<int32_t> Pixels(const std::vector<uint8_t>& mask) const;

 private:
  const Eigen::Vector3f& PointAt(int i) const {
    return cloud_.camera[window_.image_index(i % window_.width, i / window_.width, cloud_.width)];
  }
  Points RingPoints() const;
  bool SameSurface(float depth, float other) const {
    return DepthGoesOn(depth, other, window_.stride);
  }

  const OrganisedCloud& cloud_;
  const MaskWindow& window_;
  std::vector<uint8_t> kept_;
  std::vector<float> depth_;  // Depth of the window's pixels, metres; 0 = no return.
};

Points Segmentation::RingPoints() const {
  std::vector<int> ring;
  const int most = kMargin_px / window_.stride;
  for (int i = 0; i < static_cast<int>(kept_.size()); ++i) {
    if (!window_.inside[i] && window_.depth[i] <= most && depth_[i] > 0.0f) ring.push_back(i);
  }
  const size_t count = std::min(ring.size(), kMaxRingPoints);
  Points points;
  for (size_t k = 0; k < count; ++k) points.Add(PointAt(ring[k * ring.size() / count]));
  return points;
}

void Segmentation::DropBackgroundPlanes() {
  Points ring = RingPoints();
  // Fewer points of the ring may lie on a plane by chance.
  const size_t at_least = std::max<size_t>(12, ring.size() / 8);
  std::vector<int> pixels;
  Points points;
  pixels.reserve(window_.num_inside);
  points.Reserve(window_.num_inside);
  for (int v = 0; v < window_.height; ++v) {
    for (int u = 0; u < window_.width; ++u) {
      const int i = window_.index(u, v);
      if (!kept_[i]) continue;
      pixels.push_back(i);
      points.Add(cloud_.camera[window_.image_index(u, v, cloud_.width)]);
    }
  }
  Sampler sampler;
  for (int k = 0; k < kMaxPlanes && ring.size() >= at_least; ++k) {
    Plane plane;
    if (!TakePlane(&ring, at_least, &sampler, &plane)) return;
    const std::vector<uint8_t> lies_on = points.On(plane);
    int on = 0;
    int off = 0;
    int64_t depth_on = 0;
    int64_t depth_off = 0;
    for (size_t p = 0; p < pixels.size(); ++p) {
      const int i = pixels[p];
      const int depth = kept_[i] ? window_.depth[i] : 0;
      on += kept_[i] & lies_on[p];
      off += kept_[i] & ~lies_on[p];
      (lies_on[p] ? depth_on : depth_off) += depth;
    }
    if (on == 0) continue;
    // Background shows at the mask's rim. If the pixels on the plane lie about as deep in the mask
    // as the others (0.8 or more), or are more than 60 % of it, the plane is the object's own: the
    // object is flat, or has a face that extends beyond a mask that is too small.
    const bool rim =
        off > 0 && static_cast<double>(depth_on) / on < 0.8 * static_cast<double>(depth_off) / off;
    if (!rim || off < 0.4 * (on + off)) continue;
    for (size_t p = 0; p < pixels.size(); ++p) kept_[pixels[p]] &= ~lies_on[p];
  }
}

void Segmentation::DropMixedPixels() {
  const int w = window_.width;
  const float* z = depth_.data();
  uint8_t* kept = kept_.data();
  for (int v = 1; v + 1 < window_.height; ++v) {
    const int row = v * w;
    for (int i = row + 1; i < row + w - 1; ++i) {
      // The sensor averages the depths within a pixel, so that a pixel at an edge may float between
      // the near and the far surface, and would be a point where nothing is.
      const float step = 0.015f + 3.0f * DepthSigma(z[i]);
      const auto between = [&](float a, float b) {
        const float da = a - z[i];
        const float db = b - z[i];
        // Without branches, so that the loop is vectorized.
        return int{a > 0.0f} & int{b > 0.0f} & int{da * db < 0.0f} & int{std::abs(da) > step} &
               int{std::abs(db) > step};
      };
      kept[i] &= ~(between(z[i - 1], z[i + 1]) | between(z[i - w], z[i + w]));
    }
  }
}

// Returns whether a surface continues across the mask's border in at least kMinCrossings places.
// If none does, nothing touches the object, and the search for creases is skipped.
bool Segmentation::TouchesOutside() const {
  const int w = window_.width;
  const int h = window_.height;
  int crossings = 0;
  for (int i = 0; i < static_cast<int>(kept_.size()); ++i) {
    if (!kept_[i] || window_.depth[i] != 1) continue;
    const std::array<std::pair<int, bool>, 4> around = {
        {{i - 1, i % w > 0}, {i + 1, i % w + 1 < w}, {i - w, i / w > 0}, {i + w, i / w + 1 < h}}};
    for (const auto& [j, there] : around) {
      if (!there || window_.inside[j] || depth_[j] == 0.0f) continue;
      if (SameSurface(depth_[i], depth_[j]) && ++crossings >= kMinCrossings) return true;
    }
  }
  return false;
}

void Segmentation::DropTouching() {
  if (TouchesOutside()) DropNeighbours(window_, depth_, kMargin_px, &kept_);
}

struct Component {
  int pixels = 0;
  int64_t core = 0;  // Sum of its pixels' depths in the mask.
  float near = std::numeric_limits<float>::infinity();
  float far = 0.0f;
};

void Segmentation::KeepNearComponents() {
  const Components found = ConnectedComponents(
      window_.width, window_.height, [&](int i) { return kept_[i] != 0; },
      [&](int i) { return SameSurface(depth_[i], depth_[i + 1]); },
      [&](int i) { return SameSurface(depth_[i], depth_[i + window_.width]); });
  if (found.count == 0) return;
  std::vector<Component> components(found.count);
  const int size = static_cast<int>(kept_.size());
  for (int i = 0; i < size; ++i) {
    if (!kept_[i]) continue;
    Component& component = components[found.of[i]];
    ++component.pixels;
    component.core += window_.depth[i];
    component.near = std::min(component.near, depth_[i]);
    component.far = std::max(component.far, depth_[i]);
  }
  const auto main =
      std::max_element(components.begin(), components.end(),
                       [](const Component& a, const Component& b) { return a.core < b.core; });
  // Components whose ranges of depth overlap are kept, because an occluder, such as a post, can
  // split an object in two. Components of less than 1 % of the main one's pixels are noise.
  const float reach = 0.05f + 3.0f * DepthSigma(main->near);
  const int at_least = std::max(3, main->pixels / 100);
  std::vector<uint8_t> stays;
  stays.reserve(components.size());
  for (const Component& component : components) {
    stays.push_back(&component == &*main ||
                    (component.pixels >= at_least && component.near <= main->far + reach &&
                     component.far >= main->near - reach));
  }
  for (int i = 0; i < size; ++i) {
    if (kept_[i]) kept_[i] = stays[found.of[i]];
  }
}

std::vector<int32_t> Segmentation::Pixels(const std::vector<uint8_t>& mask) const {
  std::vector<int32_t> pixels;
  const int stride = window_.stride;
  pixels.reserve(static_cast<size_t>(window_.num_inside) * stride * stride);
  const int v_end = std::min(cloud_.height, window_.v0 + window_.height * stride);
  for (int v = window_.v0; v < v_end; ++v) {
    const int row = window_.index(0, (v - window_.v0) / stride);
    for (int i = row; i < row + window_.width; ++i) {
      if (!kept_[i]) continue;
      const int u_begin = window_.u0 + (i - row) * stride;
      const int u_end = std::min(cloud_.width, u_begin + stride);
      for (int32_t pixel = v * cloud_.width + u_begin; pixel < v * cloud_.width + u_end; ++pixel) {
        if (!mask[pixel] || !cloud_.valid(pixel)) continue;
        if (stride > 1 && !SameSurface(cloud_.camera[pixel].z(), depth_[i])) continue;
        pixels.push_back(pixel);
      }
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
  if (IsCancelled()) return {};
  Segmentation segmentation(cloud, window);
  segmentation.DropBackgroundPlanes();
  segmentation.DropMixedPixels();
  if (IsCancelled()) return {};
  segmentation.DropTouching();
  if (IsCancelled()) return {};
  segmentation.KeepNearComponents();
  return segmentation.Pixels(mask);
}

}  // namespace

std::unique_ptr<Segmenter> MakeOrganisedSegmenter() {
  return std::make_unique<OrganisedSegmenter>();
}

}  // namespace hypermap::ingest
