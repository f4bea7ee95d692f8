#include "ingest/perception/weight.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/perception/depth_noise.h"
#include "ingest/perception/mask_window.h"
#include "map/observations/range_weight.h"

namespace hypermap::ingest {
namespace {

// Larger masks are thinned, which leaves the share of their border about the same.
constexpr int kMaxPixels = 6000;
// A neighbour that is nearer by more than this and so many standard deviations of the depth's noise
// occludes the object. The margin is that of slanted surfaces, whose depth differs from pixel to
// pixel.
constexpr float kOccluderMargin_m = 0.05f;
constexpr float kOccluderSigmas = 3.0f;
// The largest reduction of a weight by truncation. It is reached when a fifth of the border is
// open, because the footprint then lacks a part; smaller shares reduce the weight in proportion.
constexpr double kMaxReduction = 0.4;
constexpr double kReductionPerShare = 1.0 / 0.2;

}  // namespace

double Truncation(const OrganisedCloud& cloud, const std::vector<uint8_t>& mask) {
  const MaskWindow window = CutOut(mask, cloud.width, cloud.height, 1, kMaxPixels);
  int border = 0;
  int open = 0;
  const auto in_image = [&](int u, int v) {
    return u >= 0 && v >= 0 && u < cloud.width && v < cloud.height;
  };
  // Neighbours are looked up in the image, not in the window: the window of a thinned mask may end
  // within the mask.
  for (int v = 0; v < window.height; ++v) {
    for (int u = 0; u < window.width; ++u) {
      if (!window.inside[window.index(u, v)]) continue;
      const int32_t in = window.image_index(u, v, cloud.width);
      const std::array<std::pair<int, int>, 4> around = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
      for (const auto& [du, dv] : around) {
        const int beside_u = window.u0 + (u + du) * window.stride;
        const int beside_v = window.v0 + (v + dv) * window.stride;
        const int32_t out = beside_v * cloud.width + beside_u;
        const bool there = in_image(beside_u, beside_v);
        if (there && mask[out]) continue;
        ++border;
        if (!there) {
          ++open;
          continue;
        }
        if (!cloud.valid(in) || !cloud.valid(out)) continue;
        const float z = cloud.camera[in].z();
        open += cloud.camera[out].z() < z - kOccluderMargin_m - kOccluderSigmas * DepthSigma(z);
      }
    }
  }
  return border == 0 ? 0.0 : static_cast<double>(open) / border;
}

double Weight(double range_m, double truncation) {
  return RangeWeight(range_m, 1.0 - kMaxReduction * std::min(1.0, kReductionPerShare * truncation));
}

}  // namespace hypermap::ingest
