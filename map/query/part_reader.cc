#include <functional>
#include <utility>

#include "map/query/query.h"

namespace hypermap {
namespace {

// Asks a layer, with the area (if any) in the layer's frame; null when it can't take the value.
using Ask = std::function<std::unique_ptr<AnswerCursor>(const Layer&, const Polygon* area)>;

class ScopeReader : public PartReader {
 public:
  ScopeReader(SnapshotPtr snapshot, std::string caller_frame_id, std::vector<LayerPtr> layers,
              std::optional<Polygon> area, Ask ask)
      : snapshot_(std::move(snapshot)),
        caller_frame_id_(std::move(caller_frame_id)),
        layers_(std::move(layers)),
        area_(std::move(area)),
        ask_(std::move(ask)) {}

  LayerPart Next(int max_items) override {
    LayerPart part;
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
    const auto transform = snapshot_->frames.Lookup(caller_frame_id_, layer.spec().frame_id);
    if (!transform.ok()) return AnswerStatus::kNoTransform;
    caller_from_layer_ = *transform;
    std::optional<Polygon> area_in_layer;
    if (area_) area_in_layer = caller_from_layer_.Inverse() * *area_;
    cursor_ = ask_(layer, area_in_layer ? &*area_in_layer : nullptr);
    return cursor_ ? AnswerStatus::kValue : AnswerStatus::kUnsupportedValue;
  }

  SnapshotPtr snapshot_;
  std::string caller_frame_id_;
  std::vector<LayerPtr> layers_;
  std::optional<Polygon> area_;
  Ask ask_;
  size_t current_ = 0;
  std::unique_ptr<AnswerCursor> cursor_;  // of the current layer
  PlanarTransform caller_from_layer_;     // of the current layer
};

absl::StatusOr<std::unique_ptr<PartReader>> Read(SnapshotPtr snapshot, const Scope& scope,
                                                 std::optional<Polygon> area, Ask ask) {
  absl::StatusOr<std::string> caller = snapshot->ResolveFrame(scope.frame_id);
  if (!caller.ok()) return caller.status();
  absl::StatusOr<std::vector<LayerPtr>> layers = snapshot->SelectLayers(scope.layers);
  if (!layers.ok()) return layers.status();
  return std::make_unique<ScopeReader>(std::move(snapshot), *std::move(caller), *std::move(layers),
                                       std::move(area), std::move(ask));
}

}  // namespace

absl::StatusOr<std::unique_ptr<PartReader>> ContentIn(SnapshotPtr snapshot, const Scope& scope,
                                                      const Polygon& area) {
  return Read(std::move(snapshot), scope, area, [](const Layer& layer, const Polygon* in_layer) {
    return layer.ContentIn(*in_layer);
  });
}

absl::StatusOr<std::unique_ptr<PartReader>> Search(SnapshotPtr snapshot, const Scope& scope,
                                                   const ValueQuery& value,
                                                   const std::optional<Polygon>& area) {
  return Read(
      std::move(snapshot), scope, area,
      [value](const Layer& layer, const Polygon* in_layer) { return layer.Find(value, in_layer); });
}

}  // namespace hypermap
