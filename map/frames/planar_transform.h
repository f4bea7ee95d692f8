// Rigid motions of the plane.
#ifndef HYPERMAP_MAP_FRAMES_PLANAR_TRANSFORM_H_
#define HYPERMAP_MAP_FRAMES_PLANAR_TRANSFORM_H_

#include <Eigen/Geometry>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/geometry/coordinates.h"
#include "map/geometry/point.h"
#include "map/geometry/polygon.h"
#include "map/geometry/shape.h"

namespace hypermap {

// A rotation by `yaw` (radians, counter-clockwise) followed by a translation (metres). Variables
// are named target_from_source: `map_from_robot * p` converts coordinates from `robot` to `map`,
// and map_from_robot * robot_from_camera == map_from_camera. With yaw 0, the only rounding is that
// of the addition.
class PlanarTransform {
 public:
  PlanarTransform() : PlanarTransform(0.0, 0.0, 0.0) {}
  // All three must be finite.
  PlanarTransform(double x, double y, double yaw);

  double x() const { return isometry_.translation().x(); }
  double y() const { return isometry_.translation().y(); }
  // In (-pi, pi].
  double yaw() const { return yaw_; }
  bool IsIdentity() const { return x() == 0.0 && y() == 0.0 && yaw_ == 0.0; }

  PlanarTransform Inverse() const;
  // The motion in space: about the third axis, and along the plane.
  Eigen::Isometry3d InSpace() const;

  // Returns the point that this transform maps to `p`. Rounds less than Inverse() * p far from the
  // origin.
  Point ApplyInverse(const Point& p) const;

  Point operator*(const Point& p) const;
  Polygon operator*(const Polygon& polygon) const;
  Shape operator*(const Shape& shape) const;
  PlanarTransform operator*(const PlanarTransform& other) const;

  friend bool operator==(const PlanarTransform& a, const PlanarTransform& b) {
    return a.x() == b.x() && a.y() == b.y() && a.yaw_ == b.yaw_;
  }

 private:
  Eigen::Isometry2d isometry_;
  double yaw_;
};

// Returns whether the translation is finite and at most kMaxCoordinate_m along each axis.
bool IsWithinBounds(const PlanarTransform& t);
// INVALID_ARGUMENT naming `field` unless IsWithinBounds(t).
absl::Status CheckTranslation(absl::string_view field, const PlanarTransform& t);

// Returns t * shape as a shape that can be stored. INVALID_ARGUMENT naming a vertex that is then
// not finite or more than kMaxCoordinate_m from the origin along an axis, or a ring that is so
// small that rounding has made it invalid. Errors of CheckCancelled.
absl::StatusOr<Shape> Moved(const PlanarTransform& t, const Shape& shape);

// Returns a closed box around `box` transformed by `t`. If `t` rotates, the box is wide enough to
// contain `t * p` for every point p of `box`, however that rounds.
Box BoundsOf(const PlanarTransform& t, const Box& box);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FRAMES_PLANAR_TRANSFORM_H_
