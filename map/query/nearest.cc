#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/query/layer_transforms.h"
#include "map/query/query.h"

namespace hypermap {

absl::StatusOr<NearestNeighbours> Nearest(const Snapshot& snapshot, const Scope& scope,
                                          const Point& p, const ValueQuery& value, int k) {
  if (!IsFinite(p)) return absl::InvalidArgumentError("point is not finite");
  if (k < 1) return absl::InvalidArgumentError(absl::StrCat("k is ", k, ", must be at least 1"));
  HYPERMAP_ASSIGN_OR_RETURN(std::string caller, snapshot.ResolveFrame(scope.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerPtr> layers, snapshot.SelectToAnswer(scope.layers));

  LayerTransforms transforms(snapshot, std::move(caller));
  NearestNeighbours answer;
  for (const LayerPtr& layer : layers) {
    if (snapshot.IsDamaged(*layer)) {
      answer.refusals.push_back({layer->spec().name, AnswerStatus::kDamaged});
      continue;
    }
    HYPERMAP_RETURN_IF_ERROR(transforms.Prepare(*layer));
    const auto transform = transforms.CallerFromLayer(*layer);
    if (!transform) {
      answer.refusals.push_back({layer->spec().name, AnswerStatus::kNoTransform});
      continue;
    }
    std::optional<std::vector<Neighbour>> neighbours =
        layer->Nearest(InLayer(transform->Inverse(), p), value, k);
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (!neighbours) {
      answer.refusals.push_back({layer->spec().name, AnswerStatus::kUnsupportedValue});
      continue;
    }
    if (answer.entries.empty()) answer.entries.reserve(neighbours->size());
    for (Neighbour& neighbour : *neighbours) {
      // From a point near the largest double, distances are infinite.
      neighbour.distance_m = std::min(neighbour.distance_m, std::numeric_limits<double>::max());
      answer.entries.push_back({layer, *transform, std::move(neighbour)});
    }
  }
  // Stable, so that equal distances keep the order of the layers, and in a layer the order of its
  // answer.
  const auto is_nearer = [](const NearestNeighbours::Entry& a, const NearestNeighbours::Entry& b) {
    return a.neighbour.distance_m < b.neighbour.distance_m;
  };
  if (!std::is_sorted(answer.entries.begin(), answer.entries.end(), is_nearer)) {
    std::stable_sort(answer.entries.begin(), answer.entries.end(), is_nearer);
  }
  if (answer.entries.size() > static_cast<size_t>(k)) answer.entries.resize(k);
  return answer;
}

}  // namespace hypermap
