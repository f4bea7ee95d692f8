// Classifies places by a frame's depth image: empty, occupied, hidden or out of view.
#ifndef HYPERMAP_MAP_FUSION_LOOKOUT_H_
#define HYPERMAP_MAP_FUSION_LOOKOUT_H_

#include <Eigen/Geometry>
#include <cstdint>

#include "map/observations/observation.h"

namespace hypermap::fusion {

enum class Sight : uint8_t {
  kUnseen,   // Outside the image, or no depth was measured there.
  kHidden,   // Something nearer is in front of it.
  kSurface,  // The measured depth is that of the place, within the margin.
  kEmpty,    // The ray went past it: the place is free.
};

// Looks places up in a DepthView. Keeps references to the observation, which must outlive it. Safe
// to use from many threads.
class Lookout {
 public:
  // `observation` must have depth. `margin_m` is the tolerance at range 0 when depths are compared.
  Lookout(const Observation& observation, double margin_m);

  // Classifies the point (x, y) at `height_m` above the plane, in the observation's frame. For
  // kSurface, sets `owner` (may be null) to the pixel's DepthView::owner.
  Sight At(double x, double y, double height_m, uint8_t* owner) const;

 private:
  const DepthView& view_;
  Eigen::Isometry3d camera_from_frame_;
  double margin_m_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_LOOKOUT_H_
