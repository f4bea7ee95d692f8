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

// What robots are in. The laser's plane is that of the occupancy layer: furniture that the layer
// does not have hides things from the camera, not from the laser.
struct World {
  simulation::Scene scene;
  simulation::WallGrid laser_plane;
};

struct SensesOptions {
  // FaultyDetector instead of DetectAll.
  bool noisy_detector = false;
  // PoseError, and poses refined by the walls, instead of true poses.
  bool pose_error = false;
  // Of the laser.
  double range_m = 4.0;
  // Of everything that is random.
  uint64_t seed = 1;
};

// The camera is a Kinect (simulation::Kinect, CameraPose) with its noise (WithSensorNoise). What
// was seen to be free is what the laser met, as wide as the camera sees: so that floor counts as
// explored only where the camera looked too. Not thread safe.
class Senses {
 public:
  // `world` must outlive it. `occupancy`, in the frame of the world, is what poses are refined by.
  Senses(const World& world, std::shared_ptr<const GridLayer> occupancy,
         const SensesOptions& options);

  // Where a robot that is at `pose` believes to be: call it once each step of 0.2 s.
  PlanarTransform Localise(const PlanarTransform& pose);
  // Without robot, sequence, stamp and frame.
  absl::StatusOr<Observation> Observe(const PlanarTransform& pose, const PlanarTransform& believed);

  // By body: in how many frames it was seen, counting pixels with depth within the range: what is
  // only ever seen from farther away is poor evidence.
  const std::vector<simulation::Sightings>& sightings() const { return sightings_; }

 private:
  std::vector<simulation::SimulatedDetection> Detect(const simulation::View& view,
                                                     const Eigen::Isometry3d& world_from_camera);
  void Count(const simulation::View& view, const ingest::DepthImage& depth);

  const World& world_;
  const SensesOptions options_;
  const ingest::CameraModel camera_;
  const ingest::Observer observer_;
  // Streams of their own: the depth does not depend on the detector's mistakes.
  simulation::Random localisation_, depth_, mistakes_;
  simulation::PoseError pose_error_;
  simulation::FaultyDetector detector_;
  std::vector<float> ray_lengths_;  // by pixel, for a depth of 1
  std::vector<simulation::Sightings> sightings_;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_SENSES_H_
