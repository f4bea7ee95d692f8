#include "ingest/perception/smoothing.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "ingest/perception/depth_noise.h"

namespace hypermap::ingest {
namespace {

constexpr int kSmoothingReach_px = 2;
constexpr int kNeighbours = (2 * kSmoothingReach_px + 1) * (2 * kSmoothingReach_px + 1);
// Four pixels are processed at once: all supported machines have registers of four floats.
constexpr int kLanes = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
// Depth of pixels that take no part: too far behind the camera to be on any pixel's surface.
constexpr float kNone_m = -1e6f;

Lanes Load(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

// Calls `visit(v, begin, end)` for each row that has pixels.
template <typename Visit>
void ForEachRow(const std::vector<int32_t>& pixels, int width, const Visit& visit) {
  for (const int32_t* begin = pixels.data(); begin != pixels.data() + pixels.size();) {
    const int v = *begin / width;
    const int32_t* end = begin;
    while (end != pixels.data() + pixels.size() && *end < (v + 1) * width) ++end;
    visit(v, begin, end);
    begin = end;
  }
}

// Depth of the given pixels; all others have kNone_m. Columns are grouped by their remainder modulo
// `stride`, so that one neighbour (du, dv) of every stride-th pixel of a row is contiguous in
// memory and can be loaded as a vector.
class StridedDepth {
 public:
  StridedDepth(const OrganisedCloud& cloud, const std::vector<int32_t>& pixels, int stride)
      : stride_(stride) {
    int u_min = cloud.width;
    int u_max = 0;
    ForEachRow(pixels, cloud.width, [&](int v, const int32_t* begin, const int32_t* end) {
      u_min = std::min(u_min, begin[0] - v * cloud.width);
      u_max = std::max(u_max, end[-1] - v * cloud.width);
    });
    // The buffer begins at a multiple of the stride and has a margin, so that neighbours need no
    // bounds check.
    const int margin = (kSmoothingReach_px + stride - 1) / stride * stride;
    u0_ = u_min / stride * stride - margin;
    v0_ = pixels.front() / cloud.width - kSmoothingReach_px;
    samples_ = (u_max + margin - u0_) / stride + 1;
    const int rows = pixels.back() / cloud.width + kSmoothingReach_px - v0_ + 1;
    depth_.assign(static_cast<size_t>(samples_) * stride * rows + kLanes, kNone_m);
    std::vector<int> place(static_cast<size_t>(samples_) * stride);
    for (int u = 0; u < static_cast<int>(place.size()); ++u) {
      place[u] = u % stride * samples_ + u / stride;
    }
    ForEachRow(pixels, cloud.width, [&](int v, const int32_t* begin, const int32_t* end) {
      float* row = Row(v);
      const int first = v * cloud.width + u0_;
      for (const int32_t* pixel = begin; pixel != end; ++pixel) {
        row[place[*pixel - first]] = cloud.camera[*pixel].z();
      }
    });
    size_t n = 0;
    for (int dv = -kSmoothingReach_px; dv <= kSmoothingReach_px; ++dv) {
      for (int du = -kSmoothingReach_px; du <= kSmoothingReach_px; ++du) {
        const int phase = (du % stride + stride) % stride;
        to_neighbour_[n++] =
            static_cast<ptrdiff_t>(dv * stride + phase) * samples_ + (du - phase) / stride;
      }
    }
  }

  // Returns the mean difference in depth between each stride-th pixel of row `v`, from column
  // `u_begin` to `u_last` (both multiples of the stride), and its neighbours on the same surface.
  // Values at columns that are not among the given pixels are meaningless.
  const std::vector<float>& MeanStep(int v, int u_begin, int u_last) {
    const int samples = (u_last - u_begin) / stride_ + 1;
    mean_.resize((samples + kLanes - 1) / kLanes * kLanes);
    const float* row = Row(v) + (u_begin - u0_) / stride_;
    for (int block = 0; block < samples; block += kLanes) {
      const Lanes z = Load(row + block);
      // A difference of more than three sigmas and 5 mm is an edge between two surfaces of the
      // object; averaging across it would move its points into empty space.
      const Lanes same = 3.0f * DepthSigma(z) + 0.005f;
      Lanes sum{};
      Lanes count{};
      for (const ptrdiff_t offset : to_neighbour_) {
        const Lanes dz = Load(row + block + offset) - z;
        const auto counts = (dz <= same) & (dz >= -same);
        sum += counts ? dz : Lanes{};
        count += counts ? Lanes{1.0f, 1.0f, 1.0f, 1.0f} : Lanes{};
      }
      const Lanes mean = sum / count;
      std::memcpy(mean_.data() + block, &mean, sizeof(mean));
    }
    return mean_;
  }

 private:
  float* Row(int v) { return depth_.data() + static_cast<ptrdiff_t>(v - v0_) * stride_ * samples_; }

  int stride_;
  int u0_ = 0;
  int v0_ = 0;
  int samples_ = 0;  // Columns of each remainder in a row.
  std::vector<float> depth_;
  std::array<ptrdiff_t, kNeighbours> to_neighbour_;
  std::vector<float> mean_;
};

}  // namespace

std::vector<Eigen::Vector3f> SmoothedFromCamera(const OrganisedCloud& cloud,
                                                const std::vector<int32_t>& pixels, int stride) {
  std::vector<Eigen::Vector3f> points;
  if (pixels.empty()) return points;
  points.reserve(pixels.size() / stride);
  StridedDepth depth(cloud, pixels, stride);
  std::vector<int32_t> columns;
  ForEachRow(pixels, cloud.width, [&](int v, const int32_t* begin, const int32_t* end) {
    if (v % stride != 0) return;
    columns.clear();
    for (const int32_t* pixel = begin; pixel != end; ++pixel) {
      const int u = *pixel - v * cloud.width;
      if (u % stride == 0) columns.push_back(u);
    }
    if (columns.empty()) return;
    const std::vector<float>& mean_step = depth.MeanStep(v, columns.front(), columns.back());
    for (const int u : columns) {
      const Eigen::Vector3f& p = cloud.camera[v * cloud.width + u];
      const float scale = 1.0f + mean_step[(u - columns.front()) / stride] / p.z();
      points.emplace_back(cloud.upright_from_camera * (scale * p));
    }
  });
  return points;
}

}  // namespace hypermap::ingest
