// The files of a recorded drive: TUM's RGB-D layout, COCO results, the truth and the floor plan.
#ifndef HYPERMAP_SIMULATION_WORLDS_SEQUENCE_FILES_H_
#define HYPERMAP_SIMULATION_WORLDS_SEQUENCE_FILES_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "ingest/perception/frame.h"
#include "map/frames/planar_transform.h"
#include "simulation/worlds/detector.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

// How often a body was seen.
struct Sightings {
  int frames = 0;  // with kLeastPixels or more
  int most_pixels = 0;
};

// A grey PNG of 16 bits, metres times 5000, 0 = none.
absl::StatusOr<std::string> EncodeDepthPng(const ingest::DepthImage& depth);

std::string EncodeCamera(const ingest::CameraModel& camera);

// A line "t tx ty tz qx qy qz qw" for each pose, of the camera's optical frame in the frame "map".
std::string EncodeTrajectory(const std::vector<absl::Time>& stamps,
                             const std::vector<PlanarTransform>& poses);

// The list of images, a line for each.
std::string EncodeDepthList(const std::vector<absl::Time>& stamps);
// The name of a frame's image in the folder of the drive.
std::string DepthName(absl::Time stamp);

// COCO results with run lengths; frames without a detection are listed too.
std::string EncodeDetections(const std::vector<absl::Time>& stamps,
                             const ingest::CameraModel& camera,
                             const std::vector<std::vector<SimulatedDetection>>& detections);

// GeoJSON of the footprints with `label`, heights, `detectable` and `visible_frames`.
std::string EncodeTruth(const Scene& scene, const std::vector<Sightings>& sightings);

// The floor plan as a map_server would load it, 5 cm a cell: what a laser 0.3 m above the floor
// meets is occupied.
struct FloorPlanFiles {
  std::string yaml;
  std::string pgm;
};
FloorPlanFiles EncodeFloorPlan(const Scene& scene);

absl::Status WriteFileIn(const std::string& folder, const std::string& name,
                         const std::string& data);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_SEQUENCE_FILES_H_
