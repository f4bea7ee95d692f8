// Things that touch the thing: told apart by the creases between them.
#ifndef HYPERMAP_INGEST_PERCEPTION_NEIGHBOURS_H_
#define HYPERMAP_INGEST_PERCEPTION_NEIGHBOURS_H_

#include <cmath>
#include <cstdint>
#include <vector>

#include "ingest/perception/depth_noise.h"
#include "ingest/perception/mask_window.h"

namespace hypermap::ingest {

// Whether a surface may go on from one pixel to another that is `stride` away, by their depths.
inline bool DepthGoesOn(float z, float other, int stride) {
  const float nearer = z < other ? z : other;
  return std::abs(z - other) <
         0.02f + 3.0f * DepthSigma(nearer) + 0.006f * nearer * static_cast<float>(stride);
}

// Takes pixels out of `kept` that belong to something beside the thing. Pixels of the window, and
// of the ring around the mask as far as `margin` pixels of the image, are parted where depth has a
// step and at concave creases: what touches meets in one (Stein et al. 2014, on locally convex
// connected patches). The part that lies deepest in the mask is the thing; others go where they
// continue beyond the mask. `depth`: of the window's pixels, 0 = no return. `kept`: 0 also for
// pixels that are background already.
void DropNeighbours(const MaskWindow& window, const std::vector<float>& depth, int margin,
                    std::vector<uint8_t>* kept);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_NEIGHBOURS_H_
