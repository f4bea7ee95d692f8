// Simulated instance segmentation of rendered views, exact or with mistakes.
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
  std::vector<uint8_t> mask;  // Row-major, with the values 0 and 1.
};

// Returns the number of visible pixels of each body of the scene.
std::vector<int> CountPixels(const View& view, size_t num_bodies);

// Bodies with fewer visible pixels than this are not detected.
inline constexpr int kLeastPixels = 40;

// Returns the exact masks of all bodies with at least kLeastPixels, with score 1.
std::vector<SimulatedDetection> DetectAll(const Scene& scene, const View& view);

struct DetectorFaults {
  // Share of a large body's sightings that are missed. Small bodies are missed more often.
  double misses = 0.15;
  // Share of the sightings that get a wrong class. For one body in ten the share is a half.
  double confusions = 0.06;
  // False detections per frame at random places. 0 turns phantoms off as well.
  double false_positives = 0.15;
  // Share of the detections that are reported twice.
  double duplicates = 0.02;
};

// A detector that makes mistakes: missed bodies, ragged and partial masks, wrong classes,
// duplicates, and false detections, both at random places and repeatedly at two fixed places. It
// keeps its state between frames: the bodies that it often confuses, and the two places. `scene`
// and `random` must outlive it. Not thread safe.
class FaultyDetector {
 public:
  FaultyDetector(const Scene& scene, const DetectorFaults& faults, Random& random);

  std::vector<SimulatedDetection> Detect(const View& view, const ingest::CameraModel& camera,
                                         const Eigen::Isometry3d& world_from_camera);

 private:
  // A place where an object that does not exist is detected, in a third of the frames that show it.
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
  std::vector<double> confusion_of_;  // Share of wrong classes, by body.
  std::vector<Phantom> phantoms_;
};

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_DETECTOR_H_
