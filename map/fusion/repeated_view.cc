#include "map/fusion/repeated_view.h"

#include <algorithm>
#include <cmath>

#include "map/geometry/polygon.h"

namespace hypermap::fusion {
namespace {

constexpr absl::Duration kAtOnce = absl::Milliseconds(50);
constexpr double kSameCentre_m = 0.1;
const double kCosineOfSameAxis = std::cos(1.0 * M_PI / 180.0);

}  // namespace

View ViewOf(const Observation& observation) {
  const Eigen::Isometry3d& pose = observation.pose.frame_from_camera;
  const auto num_detections = static_cast<int32_t>(observation.detections.size());
  View view{observation.robot,    observation.stamp, pose.translation(),
            pose.linear().col(2), num_detections,    {}};
  for (const Detection& detection : observation.detections) {
    const Point centre = Centroid(detection.hull);
    view.centre.x += centre.x / num_detections;
    view.centre.y += centre.y / num_detections;
  }
  return view;
}

bool RecentViews::Repeats(const View& view, double same_view_m) const {
  if (same_view_m == 0.0) return false;
  return std::any_of(views_.begin(), views_.end(), [&](const View& other) {
    return other.robot != view.robot && absl::AbsDuration(view.stamp - other.stamp) <= kAtOnce &&
           (view.position - other.position).norm() <= same_view_m &&
           view.axis.dot(other.axis) >= kCosineOfSameAxis &&
           view.num_detections == other.num_detections &&
           std::hypot(view.centre.x - other.centre.x, view.centre.y - other.centre.y) <=
               kSameCentre_m;
  });
}

void RecentViews::Add(const View& view) {
  std::erase_if(views_, [&](const View& other) { return view.stamp - other.stamp > kAtOnce; });
  if (views_.size() == kMost) views_.erase(views_.begin());
  views_.push_back(view);
}

}  // namespace hypermap::fusion
