// The published rule, as the baseline (Zaenker, Verdoja, Kyrki: "Hypermap Mapping Framework and its
// Application to Autonomous Semantic Exploration", IROS 2020, section IV-B):
// - A detection belongs to the object of its class with the greatest Jaccard index, if that is at
//   least 0.2; otherwise it is a new object.
// - Every detection raises the object's existence counter by one.
// - An object's shape is the one of its observed polygons whose centroid is nearest to the mean of
//   their centroids.
// - An object inside the convex hull of what was seen, without a detection in the frame, loses
//   one; at zero it is removed.
#ifndef HYPERMAP_MAP_FUSION_PAPER_STRATEGY_H_
#define HYPERMAP_MAP_FUSION_PAPER_STRATEGY_H_

#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

absl::StatusOr<std::unique_ptr<Strategy>> MakePaperStrategy(absl::string_view parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_PAPER_STRATEGY_H_
