#include "simulation/worlds/drive.h"

#include <cmath>
#include <numbers>

namespace hypermap::simulation {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;
constexpr double kCameraHeight = 1.1;
constexpr double kCameraTilt = 18.0 * kRadPerDegree;
constexpr double kPositionError = 0.045;
constexpr double kHeadingError = 0.9 * kRadPerDegree;

// Returns the number of frames that a motion by `amount` takes. Its end is the next motion's first
// frame.
int StepsFor(double amount, double per_second) {
  return static_cast<int>(std::ceil(std::abs(amount) / per_second * kFramesPerSecond));
}

class Driver {
 public:
  // Turns on the spot by `angle_rad`.
  void Turn(const Point& at, double angle_rad) {
    const int steps = StepsFor(angle_rad, kTurnRate_rad_per_s);
    for (int i = 0; i < steps; ++i) {
      poses.emplace_back(at.x, at.y, yaw_rad + angle_rad * i / steps);
    }
    yaw_rad += angle_rad;
  }

  void Go(const Point& from, const Point& to) {
    const int steps = StepsFor(std::hypot(to.x - from.x, to.y - from.y), kSpeed_m_per_s);
    for (int i = 0; i < steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      poses.emplace_back(from.x + t * (to.x - from.x), from.y + t * (to.y - from.y), yaw_rad);
    }
  }

  std::vector<PlanarTransform> poses;
  double yaw_rad = 0.0;
};

}  // namespace

std::vector<PlanarTransform> DriveAlong(const Ring& path) {
  Driver driver;
  for (size_t i = 0; i < path.size(); ++i) {
    const bool last = i + 1 == path.size();
    if (i % 3 == 0 || last) driver.Turn(path[i], 2.0 * std::numbers::pi);
    if (last) break;
    const double heading = std::atan2(path[i + 1].y - path[i].y, path[i + 1].x - path[i].x);
    driver.Turn(path[i], std::remainder(heading - driver.yaw_rad, 2.0 * std::numbers::pi));
    driver.Go(path[i], path[i + 1]);
  }
  return driver.poses;
}

PoseError::PoseError(Random& random)
    : random_(random),
      x_m_(random.Normal(kPositionError)),
      y_m_(random.Normal(kPositionError)),
      yaw_rad_(random.Normal(kHeadingError)) {}

PlanarTransform PoseError::Apply(const PlanarTransform& pose) {
  // The process in steps of a frame. The fresh noise keeps its variance constant.
  constexpr double kKept = 1.0 - 1.0 / (8.0 * kFramesPerSecond);
  const double fresh = std::sqrt(1.0 - kKept * kKept);
  const PlanarTransform believed(pose.x() + x_m_, pose.y() + y_m_, pose.yaw() + yaw_rad_);
  x_m_ = kKept * x_m_ + random_.Normal(fresh * kPositionError);
  y_m_ = kKept * y_m_ + random_.Normal(fresh * kPositionError);
  yaw_rad_ = kKept * yaw_rad_ + random_.Normal(fresh * kHeadingError);
  return believed;
}

std::vector<PlanarTransform> WithPoseError(const std::vector<PlanarTransform>& poses,
                                           Random& random) {
  PoseError error(random);
  std::vector<PlanarTransform> believed;
  believed.reserve(poses.size());
  for (const PlanarTransform& pose : poses) believed.push_back(error.Apply(pose));
  return believed;
}

Eigen::Isometry3d CameraPose(const PlanarTransform& world_from_robot) {
  const double yaw = world_from_robot.yaw();
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(kCameraTilt),
                                std::sin(yaw) * std::cos(kCameraTilt), -std::sin(kCameraTilt));
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = Eigen::Vector3d(world_from_robot.x(), world_from_robot.y(), kCameraHeight);
  return pose;
}

}  // namespace hypermap::simulation
