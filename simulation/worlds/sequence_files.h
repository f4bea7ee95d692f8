// Encodes the files of a recorded drive: TUM's RGB-D layout, COCO results, ground truth and floor
// plan.
#ifndef HYPERMAP_SIMULATION_WORLDS_SEQUENCE_FILES_H_
#define HYPERMAP_SIMULATION_WORLDS_SEQUENCE_FILES_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "ingest/perception/frame.h"
#include "ingest/perception/pose_sigma.h"
#include "map/frames/planar_transform.h"
#include "simulation/worlds/detector.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

// The visibility of a body in a drive.
struct Sightings {
  int frames = 0;       // Number of frames with at least kLeastPixels of it.
  int most_pixels = 0;  // Largest number of its pixels in a frame.
};

// Returns a grey PNG of 16 bits, metres times 5000, 0 = no return.
absl::StatusOr<std::string> EncodeDepthPng(const ingest::DepthImage& depth);

// Returns the YAML of ROS camera_info, without distortion.
std::string EncodeCamera(const ingest::CameraModel& camera);

// Returns a line "t tx ty tz qx qy qz qw" for each of the robot's poses: the camera's optical frame
// in the frame "map". A comment states `sigma`, which the worker's replay reads.
std::string EncodeTrajectory(const std::vector<absl::Time>& stamps,
                             const std::vector<PlanarTransform>& poses,
                             const ingest::PoseSigma& sigma);

// Returns depth.txt, with a line "t file" for each image.
std::string EncodeDepthList(const std::vector<absl::Time>& stamps);
// Returns the name of a frame's image, relative to the folder of the drive.
std::string DepthName(absl::Time stamp);

// Returns COCO's {images, categories, annotations} with masks as run lengths. Frames without
// detections are listed as images, too.
std::string EncodeDetections(const std::vector<absl::Time>& stamps,
                             const ingest::CameraModel& camera,
                             const std::vector<std::vector<SimulatedDetection>>& detections);

// Returns the ground truth as GeoJSON: footprints with `label`, heights, `detectable`,
// `visible_frames` and `max_pixels`.
std::string EncodeTruth(const Scene& scene, const std::vector<Sightings>& sightings);

// The floor plan in map_server's format, with cells of 5 cm. A cell is occupied if a laser 0.3 m
// above the floor would hit something at its centre.
struct FloorPlanFiles {
  std::string yaml;
  std::string pgm;
};
FloorPlanFiles EncodeFloorPlan(const Scene& scene);

// Writes a file, and creates the folders of its path. Errors: UNAVAILABLE, naming the file.
absl::Status WriteFileIn(const std::string& folder, const std::string& name,
                         const std::string& data);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_SEQUENCE_FILES_H_
