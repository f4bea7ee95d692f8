#include <optional>
#include <utility>

#include "base/status/status_macros.h"
#include "map/query/layer_transforms.h"
#include "map/query/query.h"

namespace hypermap {
namespace {

// The query for each layer: the matches of `value`, or all content; in `area`, or everywhere.
struct Asked {
  std::optional<ValueQuery> value;
  std::optional<Polygon> area;  // In the caller's frame; always set if there is no value.
};

class ScopeReader : public PartReader {
 public:
  ScopeReader(SnapshotPtr snapshot, std::string caller_frame_id, std::vector<LayerPtr> layers,
              Asked asked)
      : snapshot_(std::move(snapshot)),
        transforms_(*snapshot_, std::move(caller_frame_id)),
        layers_(std::move(layers)),
        asked_(std::move(asked)) {}

  LayerAnswerPart Next(int max_items) override {
    LayerAnswerPart part;
    part.layer = layers_[current_];
    if (!cursor_) {
      part.status = OpenCursor(*part.layer);
      if (part.status != AnswerStatus::kValue) {
        part.last = true;
        ++current_;
        return part;
      }
    }
    part.caller_from_layer = caller_from_layer_;
    part.part = cursor_->Next(max_items);
    if (cursor_->done()) {
      part.last = true;
      cursor_.reset();
      ++current_;
    }
    return part;
  }

  bool done() const override { return current_ == layers_.size(); }

 private:
  AnswerStatus OpenCursor(const Layer& layer) {
    if (snapshot_->IsDamaged(layer)) return AnswerStatus::kDamaged;
    const auto transform = transforms_.CallerFromLayer(layer);
    if (!transform) return AnswerStatus::kNoTransform;
    caller_from_layer_ = *transform;
    if (!asked_.area || caller_from_layer_.IsIdentity()) {
      cursor_ = Ask(layer, asked_.area ? &*asked_.area : nullptr);
    } else {
      const Polygon in_layer = caller_from_layer_.Inverse() * *asked_.area;
      cursor_ = Ask(layer, &in_layer);
    }
    return cursor_ ? AnswerStatus::kValue : AnswerStatus::kUnsupportedValue;
  }

  // Returns null if the layer does not support the value.
  std::unique_ptr<AnswerCursor> Ask(const Layer& layer, const Polygon* area) const {
    return asked_.value ? layer.Find(*asked_.value, area) : layer.ContentIn(*area);
  }

  SnapshotPtr snapshot_;
  LayerTransforms transforms_;
  std::vector<LayerPtr> layers_;
  const Asked asked_;
  size_t current_ = 0;
  std::unique_ptr<AnswerCursor> cursor_;  // Reads the current layer.
  PlanarTransform caller_from_layer_;     // From the current layer.
};

absl::StatusOr<std::unique_ptr<PartReader>> Read(SnapshotPtr snapshot, const Scope& scope,
                                                 Asked asked) {
  HYPERMAP_ASSIGN_OR_RETURN(std::string caller, snapshot->ResolveFrame(scope.frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<LayerPtr> layers, snapshot->SelectToAnswer(scope.layers));
  return std::make_unique<ScopeReader>(std::move(snapshot), std::move(caller), std::move(layers),
                                       std::move(asked));
}

}  // namespace

bool EmptyPartFilter::Keeps(const LayerAnswerPart& part) {
  const bool keeps = !part.part.empty() || (part.last && !layer_answered_);
  layer_answered_ = !part.last && (layer_answered_ || keeps);
  return keeps;
}

absl::StatusOr<std::unique_ptr<PartReader>> ContentIn(SnapshotPtr snapshot, const Scope& scope,
                                                      Polygon area) {
  return Read(std::move(snapshot), scope, {std::nullopt, std::move(area)});
}

absl::StatusOr<std::unique_ptr<PartReader>> Search(SnapshotPtr snapshot, const Scope& scope,
                                                   ValueQuery value, std::optional<Polygon> area) {
  return Read(std::move(snapshot), scope, {std::move(value), std::move(area)});
}

}  // namespace hypermap
