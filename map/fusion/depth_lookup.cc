#include "map/fusion/depth_lookup.h"

#include <cmath>

namespace hypermap::fusion {
namespace {

// Places with less depth are too close to the image plane, or behind the camera, where the
// projection is meaningless.
constexpr double kMinDepth_m = 0.1;
// Growth of the margin with the square of the depth, as noise grows (Khoshelham and Elberink 2012,
// eq. 9). More than twice the growth of the standard deviation in docs/fusion.md (0.0019 per
// metre). Depends on the sensor, so it could be a parameter, as margin_m is.
constexpr double kMarginGrowth_per_m = 0.005;

}  // namespace

DepthLookup::DepthLookup(const DepthView& view, const Eigen::Isometry3d& frame_from_camera,
                         double margin_m)
    : view_(view),
      camera_(frame_from_camera.translation()),
      camera_from_frame_(frame_from_camera.inverse()),
      margin_m_(margin_m) {}

SpaceState DepthLookup::At(double x, double y, double height_m, uint8_t* owner) const {
  const Eigen::Vector3d p = camera_from_frame_ * Eigen::Vector3d(x, y, height_m);
  if (p.z() < kMinDepth_m) return SpaceState::kUnseen;
  const double u = view_.fx * p.x() / p.z() + view_.cx + 0.5;
  const double v = view_.fy * p.y() / p.z() + view_.cy + 0.5;
  if (!(u >= 0.0 && v >= 0.0 && u < view_.columns && v < view_.rows)) return SpaceState::kUnseen;
  const size_t pixel = static_cast<size_t>(v) * view_.columns + static_cast<size_t>(u);
  const double depth = 0.001 * view_.depth_mm[pixel];
  if (depth == 0.0) return SpaceState::kUnseen;
  const double margin = margin_m_ + kMarginGrowth_per_m * p.z() * p.z();
  if (depth > p.z() + margin) return SpaceState::kEmpty;
  if (depth < p.z() - margin) return SpaceState::kOccluded;
  if (owner) *owner = view_.owner[pixel];
  return SpaceState::kSurface;
}

}  // namespace hypermap::fusion
