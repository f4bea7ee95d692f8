// A robot's camera, detector and laser in a simulated world.
#ifndef HYPERMAP_SIMULATION_ROBOTS_SENSES_H_
#define HYPERMAP_SIMULATION_ROBOTS_SENSES_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/perception/observer.h"
#include "map/observations/observation.h"
#include "simulation/worlds/detector.h"
#include "simulation/worlds/drive.h"
#include "simulation/worlds/laser.h"
#include "simulation/worlds/scene.h"
#include "simulation/worlds/sequence_files.h"

namespace hypermap::robots {

// The world of the robots. The laser sees the occupancy layer only: furniture that the layer lacks
// hides things from the camera, but not from the laser.
struct World {
  simulation::Scene scene;
  simulation::WallGrid laser_plane;
};

struct SensesOptions {
  // Detects with FaultyDetector instead of DetectAll.
  bool noisy_detector = false;
  // Adds a PoseError and refines poses by the walls, instead of true poses.
  bool pose_error = false;
  // Range of the laser.
  double range_m = 4.0;
  // Seed of all random errors.
  uint64_t seed = 1;
};

// The camera is a Kinect (simulation::Kinect, CameraPose) with its noise (WithSensorNoise). The
// free space of observations is that of the laser within the camera's horizontal field of view, so
// that floor counts as explored only where the camera looked, too. Not thread safe.
class Senses {
 public:
  // `world` must outlive the object. Poses are refined by `occupancy`, in the frame of the world.
  Senses(const World& world, std::shared_ptr<const GridLayer> occupancy,
         const SensesOptions& options);

  // Returns the pose that a robot at `pose` estimates. Call it once per step of 0.2 s.
  PlanarTransform Localise(const PlanarTransform& pose);
  // Returns the observation of a robot that is at `pose` and believes to be at `believed`. The
  // caller sets its robot, sequence, stamp and frame.
  absl::StatusOr<Observation> Observe(const PlanarTransform& pose, const PlanarTransform& believed);

  // Visibility of each body so far. Only pixels with depth within the laser's range count, because
  // a body that is only seen from farther away is poor evidence.
  const std::vector<simulation::Sightings>& sightings() const { return sightings_; }

 private:
  std::vector<simulation::SimulatedDetection> Detect(const simulation::View& view,
                                                     const Eigen::Isometry3d& world_from_camera);
  void Count(const simulation::View& view, const ingest::DepthImage& depth);

  const World& world_;
  const SensesOptions options_;
  const ingest::CameraModel camera_;
  const ingest::Observer observer_;
  // Separate generators, so that the noise of depth does not depend on the detector's mistakes.
  simulation::Random localisation_, depth_, mistakes_;
  simulation::PoseError pose_error_;
  simulation::FaultyDetector detector_;
  std::vector<float> ray_lengths_;  // Distance of each pixel's point from the camera at depth 1.
  std::vector<simulation::Sightings> sightings_;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_SENSES_H_
