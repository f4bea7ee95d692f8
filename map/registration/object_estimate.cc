#include "map/registration/object_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/geometry/shape.h"
#include "map/registration/consensus.h"
#include "map/values/value_query.h"

namespace hypermap::registration {
namespace {

// The standard deviation of an object's position: that of its place, and the share of its size by
// which the middle of its seen part differs from its middle.
constexpr double kPlaceSigma_m = 0.05;
constexpr double kSizeSigma = 0.1;
constexpr double kObjectSigmas = 3.0;
// Objects may be the same if one is at most this many times larger than the other, in length.
constexpr double kMostSizeRatio = 1.6;
// An estimate is ambiguous unless at least this many objects agree, because any two that are
// equally far apart do, a third may by chance,
constexpr size_t kLeastObjects = 4;
// they are at least this share of those that could,
constexpr double kLeastShareOfObjects = 0.3;
// and the score of the runner-up is at most this share of the best one's.
constexpr double kMostOfSecondObjects = 0.7;

// Each is kept as given, sorted, and as coordinates.
constexpr int64_t kBytesOfCorrespondence = 2 * sizeof(Correspondence) + 4 * sizeof(Point);

struct Thing {
  ObjectId id;
  Point place;
  double size_m;
};

using Things = std::map<std::string, std::vector<Thing>>;

// Returns the objects by folded label.
absl::StatusOr<Things> ThingsOf(const SemanticLayer& layer, absl::string_view name) {
  if (layer.Size() > kMaxRegisteredObjects) {
    return absl::ResourceExhaustedError(
        absl::StrCat(name, " has ", layer.Size(), " objects, more than the ", kMaxRegisteredObjects,
                     " that can be matched"));
  }
  Things things;
  for (const ObjectPtr& object : layer.Objects()) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (object->shape.empty()) continue;
    things[FoldLabel(object->label)].push_back(
        {object->id, Centroid(object->shape), std::sqrt(Area(object->shape))});
  }
  return things;
}

bool IsOfLikeSize(const Thing& a, const Thing& b) {
  return std::max(a.size_m, b.size_m) <= kMostSizeRatio * std::min(a.size_m, b.size_m);
}

Correspondence CorrespondenceOf(int source, const Thing& a, int target, const Thing& b) {
  const double sigma_m = kPlaceSigma_m + kSizeSigma * std::max(a.size_m, b.size_m);
  return {source, target, kObjectSigmas * sigma_m, {a.place, b.place, sigma_m}};
}

}  // namespace

absl::StatusOr<TransformEstimate> EstimateFromObjects(const SemanticLayer& source,
                                                      const SemanticLayer& target) {
  HYPERMAP_ASSIGN_OR_RETURN(const Things sources, ThingsOf(source, "source"));
  HYPERMAP_ASSIGN_OR_RETURN(const Things targets, ThingsOf(target, "target"));
  std::vector<Correspondence> correspondences;
  std::set<int> used_sources;
  std::set<int> used_targets;
  // By index.
  std::vector<ObjectId> source_ids;
  std::vector<ObjectId> target_ids;
  for (const auto& [label, of_source] : sources) {
    const auto found = targets.find(label);
    if (found == targets.end()) continue;
    const std::vector<Thing>& of_target = found->second;
    const auto source_base = static_cast<int>(source_ids.size());
    const auto target_base = static_cast<int>(target_ids.size());
    for (const Thing& thing : of_source) source_ids.push_back(thing.id);
    for (const Thing& thing : of_target) target_ids.push_back(thing.id);
    for (size_t i = 0; i < of_source.size(); ++i) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      const size_t before = correspondences.size();
      for (size_t j = 0; j < of_target.size(); ++j) {
        if (!IsOfLikeSize(of_source[i], of_target[j])) continue;
        const int source_index = source_base + static_cast<int>(i);
        const int target_index = target_base + static_cast<int>(j);
        used_sources.insert(source_index);
        used_targets.insert(target_index);
        correspondences.push_back(
            CorrespondenceOf(source_index, of_source[i], target_index, of_target[j]));
      }
      if (static_cast<int64_t>(correspondences.size()) > kMaxCorrespondences) {
        return absl::ResourceExhaustedError(
            absl::StrCat("more than ", kMaxCorrespondences, " pairs of objects may be the same"));
      }
      HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfCorrespondence *
                                          static_cast<int64_t>(correspondences.size() - before)));
    }
  }
  if (correspondences.empty()) {
    return absl::FailedPreconditionError(
        "no object of the source has the label and the size of one of the target");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Consensus> found, FindConsensus(correspondences));
  TransformEstimate estimate =
      EstimateOf(found, std::min(used_sources.size(), used_targets.size()));
  for (AgreeingPair& pair : estimate.agreeing) {
    pair = {source_ids[pair.source], target_ids[pair.target], pair.residual_m};
  }
  std::sort(estimate.agreeing.begin(), estimate.agreeing.end(),
            [](const AgreeingPair& a, const AgreeingPair& b) { return a.source < b.source; });
  if (found.empty() || found[0].agreeing.size() < kLeastObjects ||
      estimate.inlier_share < kLeastShareOfObjects) {
    estimate.ambiguity = Ambiguity::kLittleAgreement;
  } else if (estimate.runner_up &&
             estimate.runner_up->score > kMostOfSecondObjects * estimate.best.score) {
    estimate.ambiguity = Ambiguity::kRunnerUp;
  }
  return estimate;
}

}  // namespace hypermap::registration
