// Renders a scene as a depth camera sees it.
#ifndef HYPERMAP_SIMULATION_WORLDS_RENDERER_H_
#define HYPERMAP_SIMULATION_WORLDS_RENDERER_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "ingest/perception/frame.h"
#include "simulation/worlds/random.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

// A rendered image: the depth of each pixel along the optical axis, and the body that it shows.
struct View {
  static constexpr int16_t kStructure = -1;

  ingest::DepthImage depth;
  std::vector<int16_t> body;  // Index into Scene::bodies, or kStructure.

  int16_t body_at(int u, int v) const { return body[static_cast<size_t>(v) * depth.width + u]; }
};

// Returns a camera with a Kinect's field of view and 320 x 240 pixels.
inline ingest::CameraModel Kinect() { return {320, 240, 262.5, 262.5, 159.5, 119.5}; }

// Renders the scene with one ray through the centre of each pixel. The camera's distortion is
// ignored; its pose is that of the optical frame (x right, y down, z forward).
View Render(const Scene& scene, const ingest::CameraModel& camera,
            const Eigen::Isometry3d& world_from_camera);

// Returns the depth z as a Kinect measures it: a normal error with a standard deviation of
// 1.425e-3 m^-1 z^2, rounded to steps of 2.85e-3 m^-1 z^2 (Khoshelham and Elberink, "Accuracy and
// resolution of Kinect depth data", Sensors 2012, equation 10 and figure 10). There are no returns
// below 0.4 m and above 8 m. Along edges some pixels have no return and some mix both depths.
ingest::DepthImage WithSensorNoise(const View& view, Random& random);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_RENDERER_H_
