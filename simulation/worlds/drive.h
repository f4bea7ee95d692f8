// The drive of a robot through a scene, and the error of its localisation.
#ifndef HYPERMAP_SIMULATION_WORLDS_DRIVE_H_
#define HYPERMAP_SIMULATION_WORLDS_DRIVE_H_

#include <Eigen/Geometry>
#include <numbers>
#include <vector>

#include "map/frames/planar_transform.h"
#include "simulation/worlds/random.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

inline constexpr double kFramesPerSecond = 5.0;

// Returns the robot's pose at each frame. It follows the path at kSpeed_m_per_s, turns on the spot
// at kTurnRate_rad_per_s, and looks all round at every third vertex and at the last one.
std::vector<PlanarTransform> DriveAlong(const Ring& path);

inline constexpr double kSpeed_m_per_s = 0.4;
inline constexpr double kTurnRate_rad_per_s = 50.0 * std::numbers::pi / 180.0;

// The error of a localisation like AMCL's: an Ornstein-Uhlenbeck process with standard deviations
// of 4.5 cm in x and y and 0.9 degrees in yaw, and a correlation time of 8 seconds.
class PoseError {
 public:
  // `random` must outlive the object.
  explicit PoseError(Random& random);

  // Returns the pose that a robot at `pose` estimates. Each call advances the error by one frame.
  PlanarTransform Apply(const PlanarTransform& pose);

 private:
  Random& random_;
  double x_m_;
  double y_m_;
  double yaw_rad_;
};

// Returns the estimates for the poses of successive frames.
std::vector<PlanarTransform> WithPoseError(const std::vector<PlanarTransform>& poses,
                                           Random& random);

// Returns the pose of the camera's optical frame, 1.1 m above the floor and tilted 18 degrees down.
Eigen::Isometry3d CameraPose(const PlanarTransform& world_from_robot);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_DRIVE_H_
