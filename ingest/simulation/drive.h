// A robot's way through a scene, and where it believes to be.
#ifndef HYPERMAP_INGEST_SIMULATION_DRIVE_H_
#define HYPERMAP_INGEST_SIMULATION_DRIVE_H_

#include <Eigen/Geometry>
#include <vector>

#include "ingest/simulation/random.h"
#include "ingest/simulation/scene.h"
#include "map/frames/planar_transform.h"

namespace hypermap::simulation {

inline constexpr double kFramesPerSecond = 5.0;

// Where the robot stands at each frame: along the path at 0.4 m/s, and once round at every third
// corner, 50 degrees a second.
std::vector<PlanarTransform> DriveAlong(const Ring& path);

// The poses with an error like that of a localisation with a laser: 4.5 cm in x and in y and 0.9
// degrees of standard deviation, varying within some 8 seconds (an Ornstein-Uhlenbeck process).
std::vector<PlanarTransform> WithPoseError(const std::vector<PlanarTransform>& poses,
                                           Random& random);

// The optical frame of the robot's camera, 1.1 m high and tilted 18 degrees down.
Eigen::Isometry3d CameraPose(const PlanarTransform& world_from_robot);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_INGEST_SIMULATION_DRIVE_H_
