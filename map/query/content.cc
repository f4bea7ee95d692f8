#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/query/layer_transforms.h"
#include "map/query/query.h"

namespace hypermap {
namespace {

absl::Status CheckTolerance(double tolerance_m) {
  if (std::isfinite(tolerance_m) && tolerance_m >= 0.0) return absl::OkStatus();
  return absl::InvalidArgumentError("tolerance_m must be finite and not negative");
}

// Checks for cancellation in loops over layers. Not for each, because a look takes about as long as
// asking a small layer.
class LooksAmongLayers {
 public:
  absl::Status Next() {
    return ++num_layers_ % kLayersPerLook == 0 ? CheckCancelled() : absl::OkStatus();
  }

 private:
  static constexpr int kLayersPerLook = 32;
  int num_layers_ = 0;
};

// Bytes of the content and of its message.
int64_t MemoryOf(const PointsContent& content) {
  constexpr size_t kBytesOfValue = 2 * (sizeof(double) + sizeof(AnswerStatus));
  constexpr size_t kBytesOfHit = 2 * sizeof(PointsContent::Hit);
  return static_cast<int64_t>(content.values.size() * kBytesOfValue +
                              content.hits.size() * kBytesOfHit);
}

}  // namespace

absl::StatusOr<std::vector<LayerPointContent>> ContentAt(const Snapshot& snapshot,
                                                         const Scope& scope, const Point& p,
                                                         double tolerance_m) {
  std::vector<LayerPointContent> contents;
  contents.reserve(scope.layers.empty() ? snapshot.layers.size() : scope.layers.size());
  const absl::StatusOr<std::string> frame =
      VisitContentAt(snapshot, scope, p, tolerance_m,
                     [&contents](const LayerPtr& layer, const PlanarTransform& caller_from_layer,
                                 PointContent content) {
                       contents.push_back({layer, caller_from_layer, std::move(content)});
                     });
  HYPERMAP_RETURN_IF_ERROR(frame.status());
  return contents;
}

absl::StatusOr<std::string> VisitContentAt(const Snapshot& snapshot, const Scope& scope,
                                           const Point& p, double tolerance_m,
                                           PointContentCallback tell) {
  if (!IsFinite(p)) return absl::InvalidArgumentError("point is not finite");
  HYPERMAP_RETURN_IF_ERROR(CheckTolerance(tolerance_m));
  HYPERMAP_ASSIGN_OR_RETURN(std::string caller, snapshot.ResolveFrame(scope.frame_id));
  LayerTransforms transforms(snapshot, caller);
  const auto ask = [&](const LayerPtr& layer) {
    if (snapshot.IsDamaged(*layer)) {
      return tell(layer, PlanarTransform(), {.status = AnswerStatus::kDamaged});
    }
    const auto caller_from_layer = transforms.CallerFromLayer(*layer);
    if (caller_from_layer) {
      tell(layer, *caller_from_layer,
           layer->ContentAt(InLayer(caller_from_layer->Inverse(), p), tolerance_m));
    } else {
      tell(layer, PlanarTransform(), {.status = AnswerStatus::kNoTransform});
    }
  };
  LooksAmongLayers looks;
  // All transforms are found first, because `tell` is not called if one can't be found.
  if (scope.layers.empty()) {
    for (const auto& [name, layer] : snapshot.layers) {
      HYPERMAP_RETURN_IF_ERROR(looks.Next());
      HYPERMAP_RETURN_IF_ERROR(transforms.Prepare(*layer));
    }
    for (const auto& [name, layer] : snapshot.layers) {
      HYPERMAP_RETURN_IF_ERROR(looks.Next());
      ask(layer);
    }
    for (const auto& [name, layer] : snapshot.damaged) ask(layer.empty);
    return caller;
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<LayerPtr> layers,
                            snapshot.SelectToAnswer(scope.layers));
  for (const LayerPtr& layer : layers) {
    HYPERMAP_RETURN_IF_ERROR(looks.Next());
    HYPERMAP_RETURN_IF_ERROR(transforms.Prepare(*layer));
  }
  for (const LayerPtr& layer : layers) {
    HYPERMAP_RETURN_IF_ERROR(looks.Next());
    ask(layer);
  }
  return caller;
}

absl::StatusOr<PointsAsker> PointsAsker::Make(SnapshotPtr snapshot, const Scope& scope,
                                              double tolerance_m) {
  HYPERMAP_RETURN_IF_ERROR(CheckTolerance(tolerance_m));
  PointsAsker asker;
  asker.tolerance_m_ = tolerance_m;
  HYPERMAP_ASSIGN_OR_RETURN(std::string caller, snapshot->ResolveFrame(scope.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerPtr> layers, snapshot->SelectToAnswer(scope.layers));
  LayerTransforms transforms(*snapshot, caller);
  LooksAmongLayers looks;
  for (LayerPtr& layer : layers) {
    HYPERMAP_RETURN_IF_ERROR(looks.Next());
    HYPERMAP_RETURN_IF_ERROR(transforms.Prepare(*layer));
    AskedLayer asked;
    LayerPointsContent answer;
    const auto caller_from_layer = transforms.CallerFromLayer(*layer);
    if (snapshot->IsDamaged(*layer)) {
      answer.status = AnswerStatus::kDamaged;
    } else if (caller_from_layer) {
      asked.layer_from_caller = caller_from_layer->Inverse();
      asked.is_same_frame = layer->spec().frame_id == caller;
    } else {
      answer.status = AnswerStatus::kNoTransform;
    }
    answer.layer = std::move(layer);
    asker.asked_.push_back(asked);
    asker.answers_.push_back(std::move(answer));
  }
  asker.frame_id_ = std::move(caller);
  asker.snapshot_ = std::move(snapshot);
  return asker;
}

absl::StatusOr<absl::Span<const LayerPointsContent>> PointsAsker::ContentAtEach(
    absl::Span<const Point> points, size_t max_hits) {
  for (size_t i = 0; i < points.size(); ++i) {
    if (IsFinite(points[i])) continue;
    return absl::InvalidArgumentError(absl::StrCat("points[", i, "] is not finite"));
  }
  size_t num_hits = 0;
  for (size_t i = 0; i < answers_.size(); ++i) {
    LayerPointsContent& answer = answers_[i];
    if (answer.status != AnswerStatus::kValue) continue;
    PointsContent& content = answer.content;
    content.max_hits = max_hits - num_hits;
    if (asked_[i].is_same_frame) {
      answer.layer->ContentAtEach(points, tolerance_m_, &content);
    } else {
      in_layer_.clear();
      for (const Point& p : points) in_layer_.push_back(InLayer(asked_[i].layer_from_caller, p));
      answer.layer->ContentAtEach(in_layer_, tolerance_m_, &content);
    }
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    num_hits += content.hits.size();
    if (num_hits > max_hits) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "there are more than ", max_hits, " objects at the ", points.size(), " points"));
    }
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(MemoryOf(content)));
  }
  return answers_;
}

GridGeometry GeometryInFrame(const GridGeometry& geometry,
                             const PlanarTransform& caller_from_layer) {
  return {caller_from_layer * geometry.layer_from_grid, geometry.resolution_m};
}

}  // namespace hypermap
