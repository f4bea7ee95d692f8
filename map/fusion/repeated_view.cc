#include "map/fusion/repeated_view.h"

#include <algorithm>
#include <cmath>

namespace hypermap::fusion {
namespace {

constexpr absl::Duration kAtOnce = absl::Milliseconds(50);
constexpr double kSamePlace_m = 0.02;
const double kCosineOfSameAxis = std::cos(1.0 * M_PI / 180.0);

}  // namespace

View ViewOf(const Observation& observation) {
  const Eigen::Isometry3d& pose = observation.pose.frame_from_camera;
  return {observation.robot, observation.stamp, pose.translation(), pose.linear().col(2)};
}

bool RecentViews::Repeats(const View& view) const {
  return std::any_of(views_.begin(), views_.end(), [&](const View& other) {
    return other.robot != view.robot && absl::AbsDuration(view.stamp - other.stamp) <= kAtOnce &&
           (view.position - other.position).norm() <= kSamePlace_m &&
           view.axis.dot(other.axis) >= kCosineOfSameAxis;
  });
}

void RecentViews::Add(const View& view) {
  std::erase_if(views_, [&](const View& other) { return view.stamp - other.stamp > kAtOnce; });
  if (views_.size() == kMost) views_.erase(views_.begin());
  views_.push_back(view);
}

}  // namespace hypermap::fusion
