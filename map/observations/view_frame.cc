#include "map/observations/view_frame.h"

#include <cmath>

namespace hypermap {
namespace {

// An optical axis is taken for vertical if it is within about 2.6 degrees of that.
constexpr double kLeastHorizontal = 0.045;
// Of a metre and a radian.
constexpr double kViewUnits = 1 << 30;

}  // namespace

PlanarTransform ViewPose(const Eigen::Isometry3d& frame_from_camera) {
  Eigen::Vector3d ahead = frame_from_camera.linear().col(2);
  if (std::hypot(ahead.x(), ahead.y()) < kLeastHorizontal) {
    ahead = -frame_from_camera.linear().col(1);
  }
  const Eigen::Vector3d& position = frame_from_camera.translation();
  return {position.x(), position.y(), std::atan2(ahead.y(), ahead.x())};
}

PlanarTransform RoundedViewPose(const Eigen::Isometry3d& frame_from_camera) {
  const PlanarTransform view = ViewPose(frame_from_camera);
  const auto rounded = [](double value) { return std::round(value * kViewUnits) / kViewUnits; };
  return {rounded(view.x()), rounded(view.y()), rounded(view.yaw())};
}

Eigen::Isometry3d ViewFromCamera(const Eigen::Vector3d& up, double height_m) {
  const bool is_vertical = std::hypot(up.x(), up.y()) < kLeastHorizontal;
  const Eigen::Vector3d ahead =
      is_vertical ? Eigen::Vector3d(-Eigen::Vector3d::UnitY()) : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = (ahead - ahead.dot(up) * up).normalized();
  Eigen::Isometry3d view_from_camera = Eigen::Isometry3d::Identity();
  view_from_camera.linear() << x.transpose(), up.cross(x).transpose(), up.transpose();
  view_from_camera.translation().z() = height_m;
  return view_from_camera;
}

}  // namespace hypermap
