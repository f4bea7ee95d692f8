// render_sequence renders a robot's drive through two furnished rooms to files that hypermap-ingest
// can replay. The same arguments give the same bytes.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "ingest/perception/pose_sigma.h"
#include "simulation/worlds/detector.h"
#include "simulation/worlds/drive.h"
#include "simulation/worlds/renderer.h"
#include "simulation/worlds/scene.h"
#include "simulation/worlds/sequence_files.h"

namespace hypermap::simulation {
namespace {

struct Options {
  std::string folder;
  uint64_t seed = 1;
  int every = 1;
  DetectorFaults faults;
};

constexpr int64_t kFirstSecond = 1'700'000'000;

// The recorded drive, frame by frame, without the depth images.
struct Recording {
  std::vector<absl::Time> stamps;
  std::vector<PlanarTransform> poses;
  std::vector<PlanarTransform> estimated;
  std::vector<std::vector<SimulatedDetection>> clean;
  std::vector<std::vector<SimulatedDetection>> noisy;
  std::vector<Sightings> sightings;  // By body.
};

void Count(const View& view, std::vector<Sightings>& sightings) {
  const std::vector<int> pixels = CountPixels(view, sightings.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    sightings[i].frames += pixels[i] >= kLeastPixels;
    sightings[i].most_pixels = std::max(sightings[i].most_pixels, pixels[i]);
  }
}

// Simulates the drive. Each depth image is written at once and not kept.
absl::StatusOr<Recording> Drive(const Scene& scene, const Options& options) {
  // Each source of randomness has its own generator, so that a frame's noise does not depend on the
  // detector's faults.
  Random pose_error(options.seed + 1), sensor(options.seed + 2), mistakes(options.seed + 3);
  FaultyDetector detector(scene, options.faults, mistakes);
  const std::vector<PlanarTransform> way = DriveAlong(scene.path);
  const std::vector<PlanarTransform> believed = WithPoseError(way, pose_error);
  Recording recording;
  recording.sightings.resize(scene.bodies.size());
  for (size_t i = 0; i < way.size(); i += static_cast<size_t>(options.every)) {
    const absl::Time stamp = absl::FromUnixSeconds(kFirstSecond) +
                             static_cast<int64_t>(i) * absl::Seconds(1) / kFramesPerSecond;
    const Eigen::Isometry3d pose = CameraPose(way[i]);
    const View view = Render(scene, Kinect(), pose);
    HYPERMAP_ASSIGN_OR_RETURN(const auto png, EncodeDepthPng(WithSensorNoise(view, sensor)));
    HYPERMAP_RETURN_IF_ERROR(WriteFileIn(options.folder, DepthName(stamp), png));
    recording.stamps.push_back(stamp);
    recording.poses.push_back(way[i]);
    recording.estimated.push_back(believed[i]);
    recording.clean.push_back(DetectAll(scene, view));
    recording.noisy.push_back(detector.Detect(view, Kinect(), pose));
    Count(view, recording.sightings);
  }
  return recording;
}

absl::Status WriteSequence(const Options& options) {
  const Scene scene = MakeOffice(options.seed);
  HYPERMAP_ASSIGN_OR_RETURN(const Recording r, Drive(scene, options));
  const FloorPlanFiles plan = EncodeFloorPlan(scene);
  const std::pair<const char*, std::string> files[] = {
      {"depth.txt", EncodeDepthList(r.stamps)},
      {"groundtruth.txt", EncodeTrajectory(r.stamps, r.poses, ingest::kMotionCaptureSigma)},
      {"estimated.txt", EncodeTrajectory(r.stamps, r.estimated, ingest::kLocalisationSigma)},
      {"camera.yaml", EncodeCamera(Kinect())},
      {"detections_clean.json", EncodeDetections(r.stamps, Kinect(), r.clean)},
      {"detections_noisy.json", EncodeDetections(r.stamps, Kinect(), r.noisy)},
      {"gt.geojson", EncodeTruth(scene, r.sightings)},
      {"occupancy.yaml", plan.yaml},
      {"occupancy.pgm", plan.pgm},
  };
  for (const auto& [name, data] : files) {
    HYPERMAP_RETURN_IF_ERROR(WriteFileIn(options.folder, name, data));
  }
  std::cout << r.stamps.size() << " frames of " << scene.bodies.size() << " objects in "
            << options.folder << '\n';
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Renders a robot's drive through two furnished rooms.", "render_sequence");
  app.add_option("folder", options.folder, "Folder for the files; created if there is none")
      ->required();
  app.add_option("--seed", options.seed,
                 "Random seed, which determines the rooms and their furniture")
      ->capture_default_str();
  app.add_option("--every", options.every, "Write every n-th frame")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  const auto add_share = [&app](const char* name, double& value, const char* help) {
    app.add_option(name, value, help)->check(CLI::Range(0.0, 1.0))->capture_default_str();
  };
  add_share("--misses", options.faults.misses, "Share of sightings that the detector misses");
  add_share("--confusions", options.faults.confusions, "Share of sightings that get a wrong class");
  add_share("--false-positives", options.faults.false_positives,
            "Mean number of false positives per frame");
  add_share("--duplicates", options.faults.duplicates,
            "Share of detections that are reported twice");
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = WriteSequence(options);
  if (status.ok()) return 0;
  std::cerr << "render_sequence: " << status.message() << std::endl;
  return 1;
}

}  // namespace
}  // namespace hypermap::simulation

int main(int argc, char** argv) { return hypermap::simulation::Main(argc, argv); }
