// A camera for tests.
#ifndef HYPERMAP_SIMULATION_WORLDS_TESTING_CAMERA_H_
#define HYPERMAP_SIMULATION_WORLDS_TESTING_CAMERA_H_

#include "ingest/perception/frame.h"

namespace hypermap::simulation {

// Returns a Kinect's camera at half its resolution.
inline ingest::CameraModel Camera() { return {320, 240, 262.5, 262.5, 159.5, 119.5}; }

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_TESTING_CAMERA_H_
