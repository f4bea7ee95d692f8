#include "simulation/robots/senses.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/status/status_macros.h"
#include "ingest/perception/organised_cloud.h"
#include "ingest/perception/pose_sigma.h"
#include "simulation/worlds/renderer.h"

namespace hypermap::robots {
namespace {

using ingest::Frame;
using simulation::SimulatedDetection;
using simulation::View;

simulation::LaserFan FanOf(const ingest::CameraModel& camera, double range_m) {
  return {std::atan(0.5 * camera.width / camera.fx), range_m};
}

}  // namespace

Senses::Senses(const World& world, std::shared_ptr<const GridLayer> occupancy,
               const SensesOptions& options)
    : world_(world),
      options_(options),
      camera_(simulation::Kinect()),
      observer_(ingest::MakeOrganisedSegmenter(),
                options.pose_error ? std::move(occupancy) : nullptr, ingest::ObserverOptions()),
      localisation_(3 * options.seed + 1),
      depth_(3 * options.seed + 2),
      mistakes_(3 * options.seed + 3),
      pose_error_(localisation_),
      detector_(world.scene, simulation::DetectorFaults(), mistakes_),
      sightings_(world.scene.bodies.size()) {
  for (const Eigen::Vector2f& ray : ingest::PixelRays(camera_)) {
    ray_lengths_.push_back(ray.homogeneous().norm());
  }
}

PlanarTransform Senses::Localise(const PlanarTransform& pose) {
  return options_.pose_error ? pose_error_.Apply(pose) : pose;
}

absl::StatusOr<Observation> Senses::Observe(const PlanarTransform& pose,
                                            const PlanarTransform& believed) {
  const Eigen::Isometry3d world_from_camera = simulation::CameraPose(pose);
  const View view = simulation::Render(world_.scene, camera_, world_from_camera);
  Frame frame;
  frame.camera = camera_;
  frame.depth = simulation::WithSensorNoise(view, depth_);
  Count(view, frame.depth);
  frame.frame_from_camera = simulation::CameraPose(believed);
  frame.pose_covariance =
      (options_.pose_error ? ingest::kLocalisationSigma : ingest::kMotionCaptureSigma).Covariance();
  for (SimulatedDetection& detection : Detect(view, world_from_camera)) {
    frame.instances.push_back({{{detection.label, detection.score}}, std::move(detection.mask)});
  }
  // Validation requires a name; the caller replaces it.
  frame.robot = "robot";
  HYPERMAP_ASSIGN_OR_RETURN(Observation observation, observer_.Observe(frame, nullptr));
  const Polygon free =
      simulation::FreeBefore(world_.laser_plane, pose, FanOf(camera_, options_.range_m));
  // The robot's camera looks straight ahead, so that its view is where the robot is.
  observation.free_space = pose.Inverse() * free;
  return observation;
}

std::vector<SimulatedDetection> Senses::Detect(const View& view,
                                               const Eigen::Isometry3d& world_from_camera) {
  return options_.noisy_detector ? detector_.Detect(view, camera_, world_from_camera)
                                 : simulation::DetectAll(world_.scene, view);
}

void Senses::Count(const View& view, const ingest::DepthImage& depth) {
  std::vector<int> pixels(sightings_.size(), 0);
  for (size_t i = 0; i < view.body.size(); ++i) {
    const float z = depth.metres[i];
    if (view.body[i] < 0 || z == 0.0f || z * ray_lengths_[i] > options_.range_m) continue;
    ++pixels[static_cast<size_t>(view.body[i])];
  }
  for (size_t i = 0; i < pixels.size(); ++i) {
    sightings_[i].frames += pixels[i] >= simulation::kLeastPixels;
    sightings_[i].most_pixels = std::max(sightings_[i].most_pixels, pixels[i]);
  }
}

}  // namespace hypermap::robots
