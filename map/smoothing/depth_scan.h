// The upright surfaces in a frame's depth image, by which frames are matched to each other.
#ifndef HYPERMAP_MAP_SMOOTHING_DEPTH_SCAN_H_
#define HYPERMAP_MAP_SMOOTHING_DEPTH_SCAN_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "map/observations/observation.h"

namespace hypermap::smoothing {

// A point on an upright surface. Positions are in metres in the view frame of the observation: the
// origin on the plane below the camera, x along its optical axis, z up (ViewPose).
struct SurfacePoint {
  Eigen::Vector3f position;
  Eigen::Vector2f normal;  // Of the surface, on the plane, towards the camera; of length 1.
  float sigma_m = 0.0f;    // Standard deviation along the normal.
};

// A point at which something ends to the left or right, in front of what is farther.
struct EdgePoint {
  Eigen::Vector3f position;
  float sigma_m = 0.0f;  // Standard deviation across the line of sight.
  int16_t column = 0;    // Of its pixel.
  bool is_right = false;
};

// Immutable; safe to use from many threads. Takes about 50 kB for a depth image of 80 x 60 pixels.
class DepthScan {
 public:
  // REQUIRES: `observation` has depth. Only the height and tilt of its pose are used.
  explicit DepthScan(const Observation& observation);

  const std::vector<SurfacePoint>& surface() const { return surface_; }
  const std::vector<EdgePoint>& edges() const { return edges_; }
  // Memory of the scan.
  int64_t bytes() const;

  // The surface that is seen in the pixel of a place (view frame); null if there is none.
  const SurfacePoint* SurfaceAt(const Eigen::Vector3f& place) const;
  // The edge of the same side that is seen near a place; null if there is none.
  const EdgePoint* EdgeNear(const Eigen::Vector3f& place, bool is_right) const;

 private:
  struct Pixel {
    int u = 0;
    int v = 0;
  };
  // The pixel of a place, which may be outside the image; false if the place is behind the camera.
  bool PixelOf(const Eigen::Vector3f& place, Pixel* pixel) const;
  bool IsInside(const Pixel& pixel) const {
    return pixel.u >= 0 && pixel.v >= 0 && pixel.u < columns_ && pixel.v < rows_;
  }
  size_t IndexOf(const Pixel& pixel) const {
    return static_cast<size_t>(pixel.v) * static_cast<size_t>(columns_) +
           static_cast<size_t>(pixel.u);
  }
  Eigen::Vector3f InCamera(const DepthView& view, const Pixel& pixel) const;
  void FindSurface(const DepthView& view);
  void FindEdges(const DepthView& view);

  int columns_;
  int rows_;
  Eigen::Vector2f focal_;
  Eigen::Vector2f centre_;
  Eigen::Isometry3f view_from_camera_;
  Eigen::Isometry3f camera_from_view_;
  std::vector<SurfacePoint> surface_;
  std::vector<int32_t> surface_of_;  // Of each pixel the index of its point, or -1.
  std::vector<EdgePoint> edges_;     // By row, then column.
  std::vector<int32_t> row_begin_;   // Of each row the index of its first edge, and the end.
};

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_DEPTH_SCAN_H_
