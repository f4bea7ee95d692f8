// Classifies places by a frame's depth image: empty, surface, occluded or unseen.
#ifndef HYPERMAP_MAP_FUSION_DEPTH_LOOKUP_H_
#define HYPERMAP_MAP_FUSION_DEPTH_LOOKUP_H_

#include <Eigen/Geometry>
#include <cstdint>

#include "map/observations/observation.h"

namespace hypermap::fusion {

// The state of a place as a depth image shows it.
enum class SpaceState : uint8_t {
  kUnseen,    // Outside the image, or no depth was measured there.
  kOccluded,  // Something nearer is in front of it.
  kSurface,   // The measured depth is that of the place, within the margin.
  kEmpty,     // The ray went past it: the place is free.
};

// Looks places up in a DepthView, each in constant time. Keeps a reference to the view, which must
// outlive it. Safe to use from many threads.
class DepthLookup {
 public:
  // `margin_m` is the tolerance at range 0 when depths are compared.
  DepthLookup(const DepthView& view, const Eigen::Isometry3d& frame_from_camera, double margin_m);

  // Classifies the point (x, y) at `height_m` above the plane, in the frame of the camera's pose.
  // For kSurface, sets `owner` (may be null) to the pixel's DepthView::owner.
  SpaceState At(double x, double y, double height_m, uint8_t* owner) const;

  // Position of the camera, in the same frame.
  const Eigen::Vector3d& camera() const { return camera_; }

 private:
  const DepthView& view_;
  Eigen::Vector3d camera_;
  Eigen::Isometry3d camera_from_frame_;
  double margin_m_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_DEPTH_LOOKUP_H_
