// Poses on the plane as vectors (x, y, yaw), for Gauss-Newton.
#ifndef HYPERMAP_MAP_SMOOTHING_PLANAR_POSE_H_
#define HYPERMAP_MAP_SMOOTHING_PLANAR_POSE_H_

#include <Eigen/Core>
#include <cmath>

namespace hypermap::smoothing {

// x and y in metres, yaw in radians.
using PlanarPose = Eigen::Vector3d;

// Returns the angle in [-pi, pi].
inline double Wrapped(double angle) { return std::remainder(angle, 2.0 * M_PI); }

// The rotation of a pose.
class Turn {
 public:
  explicit Turn(double yaw) : cos_(std::cos(yaw)), sin_(std::sin(yaw)) {}

  Eigen::Vector2d operator*(const Eigen::Vector2d& v) const {
    return {cos_ * v.x() - sin_ * v.y(), sin_ * v.x() + cos_ * v.y()};
  }
  Eigen::Vector2d Inverse(const Eigen::Vector2d& v) const {
    return {cos_ * v.x() + sin_ * v.y(), cos_ * v.y() - sin_ * v.x()};
  }

 private:
  double cos_;
  double sin_;
};

// The pose `to` in the axes of `from`.
inline PlanarPose MotionBetween(const PlanarPose& from, const PlanarPose& to) {
  const Eigen::Vector2d apart = Turn(from.z()).Inverse((to - from).head<2>());
  return {apart.x(), apart.y(), Wrapped(to.z() - from.z())};
}

// The derivative of a turned vector by the angle.
inline Eigen::Vector2d Perpendicular(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

// Weight of a residual whose square is `ratio2` times that of the kernel (Geman and McClure 1985).
inline double GemanMcClure(double ratio2) { return 1.0 / ((1.0 + ratio2) * (1.0 + ratio2)); }

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_PLANAR_POSE_H_
