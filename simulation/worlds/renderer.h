// What a depth camera sees of a scene.
#ifndef HYPERMAP_SIMULATION_WORLDS_RENDERER_H_
#define HYPERMAP_SIMULATION_WORLDS_RENDERER_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "ingest/perception/frame.h"
#include "simulation/worlds/random.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

// Every pixel's depth along the optical axis, and whose it is.
struct View {
  static constexpr int16_t kStructure = -1;

  ingest::DepthImage depth;
  std::vector<int16_t> body;  // index into Scene::bodies, or kStructure

  int16_t body_at(int u, int v) const { return body[static_cast<size_t>(v) * depth.width + u]; }
};

// A Kinect's field of view, 320 x 240 pixels.
inline ingest::CameraModel Kinect() { return {320, 240, 262.5, 262.5, 159.5, 119.5}; }

// Casts one ray through the middle of each pixel. The camera is not distorted; its pose is that of
// the optical frame (x right, y down, z forward).
View Render(const Scene& scene, const ingest::CameraModel& camera,
            const Eigen::Isometry3d& world_from_camera);

// The depth as a Kinect gives it: random error with a standard deviation of 1.425e-3 m at 1 m that
// grows with the square of the distance, in steps of 2.85e-3 m z^2 (Khoshelham and Elberink,
// "Accuracy and resolution of Kinect depth data", Sensors 2012, equation 10 and figure 10), nothing
// nearer than 0.4 m or farther than 8 m. Along edges some pixels fail and some mix both depths.
ingest::DepthImage WithSensorNoise(const View& view, Random& random);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_RENDERER_H_
