// What a frame's depth says of a place: seen through, something there, hidden, or not looked at.
#ifndef HYPERMAP_MAP_FUSION_LOOKOUT_H_
#define HYPERMAP_MAP_FUSION_LOOKOUT_H_

#include <Eigen/Geometry>
#include <cstdint>

#include "map/observations/observation.h"

namespace hypermap::fusion {

enum class Sight : uint8_t {
  kUnseen,   // out of the image, or no return there
  kHidden,   // something nearer stands in the way
  kSurface,  // a return from there, give or take the margin
  kEmpty,    // the ray went on beyond
};

// Reads a DepthView. Holds references to the observation. Safe to read from many threads.
class Lookout {
 public:
  // `observation` must have depth. `margin_m`: what a return may be off and still be from there.
  Lookout(const Observation& observation, double margin_m);

  // Of the point (x, y) at `height_m` above the plane, in the observation's frame. `owner` is set
  // for kSurface and may be null.
  Sight At(double x, double y, double height_m, uint8_t* owner) const;

 private:
  const DepthView& view_;
  Eigen::Isometry3d camera_from_frame_;
  double margin_m_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_LOOKOUT_H_
