// A robot's way through a scene, and where it believes to be.
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

// Where the robot stands at each frame: along the path at 0.4 m/s, and once round at every third
// corner, 50 degrees a second.
std::vector<PlanarTransform> DriveAlong(const Ring& path);

inline constexpr double kSpeed_m_per_s = 0.4;
inline constexpr double kTurnRate_rad_per_s = 50.0 * std::numbers::pi / 180.0;

// An error like that of a localisation with a laser: 4.5 cm in x and in y and 0.9 degrees of
// standard deviation, varying within some 8 seconds (an Ornstein-Uhlenbeck process).
class PoseError {
 public:
  // `random` must outlive it.
  explicit PoseError(Random& random);

  // Where a robot at `pose` believes to be; each call is a frame later.
  PlanarTransform Apply(const PlanarTransform& pose);

 private:
  Random& random_;
  double x_m_;
  double y_m_;
  double yaw_rad_;
};

// The poses with that error.
std::vector<PlanarTransform> WithPoseError(const std::vector<PlanarTransform>& poses,
                                           Random& random);

// The optical frame of the robot's camera, 1.1 m high and tilted 18 degrees down.
Eigen::Isometry3d CameraPose(const PlanarTransform& world_from_robot);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_DRIVE_H_
