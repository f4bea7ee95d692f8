// What an instance segmentation network would find in a view, with its mistakes.
#ifndef HYPERMAP_SIMULATION_WORLDS_DETECTOR_H_
#define HYPERMAP_SIMULATION_WORLDS_DETECTOR_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "ingest/perception/frame.h"
#include "simulation/worlds/random.h"
#include "simulation/worlds/renderer.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

struct SimulatedDetection {
  std::string label;
  double score = 1.0;
  std::vector<uint8_t> mask;  // row-major, 0 or 1
};

// Pixels of each body of the scene that are seen.
std::vector<int> CountPixels(const View& view, size_t num_bodies);

// Bodies with fewer pixels than this are not found.
inline constexpr int kLeastPixels = 40;

// Exact masks of all bodies that are large enough.
std::vector<SimulatedDetection> DetectAll(const Scene& scene, const View& view);

struct DetectorFaults {
  // Share of the sightings of a large body that are missed; small ones are missed more often.
  double misses = 0.15;
  // Share of the sightings that get another class. One body in ten is confused half of the time.
  double confusions = 0.06;
  // Found where there is nothing, a frame.
  double false_positives = 0.15;
  // Share of the detections that are given twice.
  double duplicates = 0.02;
};

// A detector that makes mistakes: ragged and partial masks, wrong classes, things that are not
// there at random places and at two places again and again. Keeps what is wrong with which body.
class FaultyDetector {
 public:
  FaultyDetector(const Scene& scene, const DetectorFaults& faults, Random& random);

  std::vector<SimulatedDetection> Detect(const View& view, const ingest::CameraModel& camera,
                                         const Eigen::Isometry3d& world_from_camera);

 private:
  // A place that is taken for something whenever it is seen, every third time.
  struct Phantom {
    Eigen::Vector3d place;
    std::string label;
  };

  std::string LabelFor(size_t body);
  SimulatedDetection Sighting(const View& view, size_t body, int pixels);
  void AddStray(const View& view, std::vector<SimulatedDetection>& detections);
  void AddPhantoms(const View& view, const ingest::CameraModel& camera,
                   const Eigen::Isometry3d& world_from_camera,
                   std::vector<SimulatedDetection>& detections);

  const Scene& scene_;
  const DetectorFaults faults_;
  Random& random_;
  std::vector<double> confusion_of_;  // by body
  std::vector<Phantom> phantoms_;
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_DETECTOR_H_
