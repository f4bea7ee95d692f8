#include "ingest/perception/observer.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "ingest/perception/footprint.h"
#include "ingest/perception/ground_plane.h"
#include "ingest/perception/suppression.h"
#include "ingest/perception/visibility.h"
#include "ingest/perception/wall_matcher.h"
#include "ingest/perception/weight.h"
#include "map/observations/view_frame.h"

namespace hypermap::ingest {
namespace {

// Width of the thinned depth image, in pixels (docs/decisions/008).
constexpr int kViewColumns = 80;
// Bytes of each pixel: the rays, which another thread may replace in the cache meanwhile, the
// points of the cloud, and the smoothed depth of a footprint.
constexpr int kBytesPerPixel = 2 * sizeof(Eigen::Vector2f) + sizeof(Eigen::Vector3f) + 8;

// Returns the instances without duplicates; of more than `limit`, those with the best scores.
Suppressed Chosen(const Frame& frame, int limit) {
  Suppressed all = SuppressDuplicates(frame);
  if (static_cast<int>(all.kept.size()) <= limit) return all;
  std::vector<int> order(all.kept.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return BestScore(frame.instances[all.kept[a]]) > BestScore(frame.instances[all.kept[b]]);
  });
  order.resize(limit);
  std::sort(order.begin(), order.end());
  Suppressed some;
  for (const int i : order) {
    some.kept.push_back(all.kept[i]);
    some.scores.push_back(all.scores[i]);
  }
  return some;
}

// Returns the pose turned by motion.z() about its origin, and then moved by (motion.x(),
// motion.y()).
PlanarTransform Moved(const PlanarTransform& pose, const Eigen::Vector3d& motion) {
  return {pose.x() + motion.x(), pose.y() + motion.y(), pose.yaw() + motion.z()};
}

}  // namespace

struct Observer::Impl {
  // Returns the rays of the camera's pixels. The rays of the last camera are cached, since frames
  // in sequence come from one camera and undistortion is iterative. They are computed without the
  // lock, because other threads must not wait for those of a large image.
  absl::StatusOr<std::shared_ptr<const std::vector<Eigen::Vector2f>>> Rays(
      const CameraModel& camera) const {
    {
      const MutexLock lock(&mutex);
      if (rays && camera == rays_of) return rays;
    }
    auto made = std::make_shared<const std::vector<Eigen::Vector2f>>(PixelRays(camera));
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const MutexLock lock(&mutex);
    rays_of = camera;
    rays = made;
    return made;
  }

  mutable Mutex mutex;
  mutable CameraModel rays_of ABSL_GUARDED_BY(mutex);
  mutable std::shared_ptr<const std::vector<Eigen::Vector2f>> rays ABSL_GUARDED_BY(mutex);
  std::unique_ptr<Segmenter> segmenter;
  std::unique_ptr<WallMatcher> walls;
  ObserverOptions options;
};

Observer::Observer(std::unique_ptr<Segmenter> segmenter,
                   const std::shared_ptr<const GridLayer>& occupancy,
                   const ObserverOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->segmenter = std::move(segmenter);
  if (occupancy) impl->walls = std::make_unique<WallMatcher>(*occupancy);
  impl->options = options;
  impl_ = std::move(impl);
}

Observer::~Observer() = default;

int Observer::bytes_per_pixel() const {
  return kBytesPerPixel + impl_->segmenter->bytes_per_pixel();
}

absl::StatusOr<Observation> Observer::Observe(const Frame& frame, FrameReport* report) const {
  HYPERMAP_RETURN_IF_ERROR(Validate(frame));
  FrameReport unused;
  FrameReport& told = report ? *report : unused;
  told = {};
  told.instances = static_cast<int>(frame.instances.size());

  Observation observation;
  observation.robot = frame.robot;
  observation.sequence = frame.sequence;
  observation.stamp = frame.stamp;
  observation.frame_id = frame.frame_id;
  HYPERMAP_ASSIGN_OR_RETURN(const auto rays, impl_->Rays(frame.camera));
  const GroundPlane ground = GroundOf(frame.depth, *rays, ClaimedGround(frame.frame_from_camera));
  const Eigen::Isometry3d view_from_camera = ViewFromCamera(ground.up, ground.height_m);
  observation.frame_from_view =
      frame.frame_from_view.value_or(RoundedViewPose(frame.frame_from_camera));
  observation.pose = {view_from_camera, frame.pose_covariance};
  OrganisedCloud cloud = MakeCloud(frame.depth, view_from_camera, *rays);
  if (impl_->walls) {
    MoveCloud(observation.frame_from_view->InSpace() * view_from_camera, &cloud);
    const PoseCorrection correction = impl_->walls->Match(cloud, frame.pose_covariance);
    if (!correction.motion.isZero(0.0)) {
      observation.claim = PoseClaim{*observation.frame_from_view, frame.pose_covariance};
    }
    observation.frame_from_view = Moved(*observation.frame_from_view, correction.motion);
    observation.pose.covariance = correction.covariance;
    MoveCloud(view_from_camera, &cloud);
  }

  const Suppressed chosen = Chosen(frame, impl_->options.max_instances);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  told.suppressed = told.instances - static_cast<int>(chosen.kept.size());
  FootprintOptions footprint_options;
  footprint_options.max_range_m = static_cast<float>(impl_->options.max_range_m);
  std::vector<const std::vector<uint8_t>*> masks;
  for (size_t k = 0; k < chosen.kept.size(); ++k) {
    const Instance& instance = frame.instances[chosen.kept[k]];
    const auto pixels = impl_->segmenter->Segment(cloud, instance.mask);
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    auto footprint = MakeFootprint(cloud, pixels, footprint_options);
    if (!footprint) {
      ++told.without_points;
      continue;
    }
    Detection detection;
    detection.scores = chosen.scores[k];
    detection.truncation = Truncation(cloud, instance.mask);
    detection.weight = Weight(footprint->range_m, detection.truncation);
    detection.hull = std::move(footprint->hull);
    detection.cells = std::move(footprint->cells);
    detection.height = footprint->height;
    detection.num_points = footprint->num_points;
    detection.range_m = footprint->range_m;
    observation.detections.push_back(std::move(detection));
    masks.push_back(&instance.mask);
  }
  told.detections = static_cast<int>(observation.detections.size());

  VisibilityOptions visibility;
  visibility.max_range_m = static_cast<float>(impl_->options.max_range_m);
  observation.view_hull = ViewHull(cloud, visibility);
  observation.free_space = FreeSpace(cloud, visibility);
  const int stride = std::max(1, frame.camera.width / kViewColumns);
  observation.depth = ThinnedDepth(cloud, frame.camera, stride, masks);
  HYPERMAP_RETURN_IF_ERROR(Validate(observation));
  return observation;
}

}  // namespace hypermap::ingest
