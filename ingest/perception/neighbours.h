// Separation of an object from things that touch it, at the creases between them.
#ifndef HYPERMAP_INGEST_PERCEPTION_NEIGHBOURS_H_
#define HYPERMAP_INGEST_PERCEPTION_NEIGHBOURS_H_

#include <cmath>
#include <cstdint>
#include <vector>

#include "ingest/perception/depth_noise.h"
#include "ingest/perception/mask_window.h"

namespace hypermap::ingest {

// Returns whether two pixels that are `stride` apart may show one surface, given their depths in
// metres. The tolerance grows with depth noise, and with the distance between the pixels' rays,
// because the depth of a slanted surface changes from ray to ray.
inline bool DepthGoesOn(float z, float other, int stride) {
  const float nearer = z < other ? z : other;
  return std::abs(z - other) <
         0.02f + 3.0f * DepthSigma(nearer) + 0.006f * nearer * static_cast<float>(stride);
}

// Clears the pixels of `kept` that belong to things beside the object. The mask's kept pixels and a
// ring of `margin` pixels of the image around it are split into parts at depth steps and at concave
// creases, in which touching things meet (Stein et al. 2014, on locally convex connected patches).
// The part that lies deepest in the mask is the object. Another part is dropped if most of it lies
// outside the mask and it reaches only into the mask's rim. `depth` holds the depth of the window's
// pixels in metres, 0 = no return; `kept` is 0 on entry for pixels already found to be background.
void DropNeighbours(const MaskWindow& window, const std::vector<float>& depth, int margin,
                    std::vector<uint8_t>* kept);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_NEIGHBOURS_H_
