// Tells observations that repeat what another robot has sent.
#ifndef HYPERMAP_MAP_FUSION_REPEATED_VIEW_H_
#define HYPERMAP_MAP_FUSION_REPEATED_VIEW_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include "map/geometry/point.h"
#include "map/observations/observation.h"

namespace hypermap::fusion {

// Whose camera looked from where, when, and at what.
struct View {
  std::string robot;
  absl::Time stamp;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // of the camera, in the layer's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     // unit vector along which it looked
  int32_t num_detections = 0;
  Point centre;  // mean of the detections' centroids, in the layer's frame; the origin if none
};
View ViewOf(const Observation& observation);

// The newest views, as many as several robots have at once. The views of a state are added in the
// order of their stamps.
class RecentViews {
 public:
  static constexpr size_t kMost = 64;

  RecentViews() = default;
  explicit RecentViews(std::vector<View> views) : views_(std::move(views)) {}

  // Whether another robot had this view within 50 ms, `same_view_m` and 1 degree, with as many
  // detections around the same centre (within 10 cm): it is the same frame under another name, and
  // has the same errors. Not if `same_view_m` is 0.
  bool Repeats(const View& view, double same_view_m) const;
  void Add(const View& view);
  // In the order in which they were added.
  const std::vector<View>& views() const { return views_; }

 private:
  std::vector<View> views_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_REPEATED_VIEW_H_
