#include "server/fusion/explored_area.h"

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"

namespace hypermap::server {
namespace {

constexpr double kExplored = 1.0;

}  // namespace

ExploredArea::ExploredArea(const Snapshot& snapshot, const std::string& exploration_layer,
                           const std::string& frame_id)
    : layer_(exploration_layer), frame_id_(frame_id) {
  const Layer* layer = snapshot.FindLayer(exploration_layer);
  if (layer == nullptr || layer->spec().kind != LayerKind::kExploration) return;
  const absl::StatusOr<PlanarTransform> layer_from_frame =
      snapshot.frames.Lookup(layer->spec().frame_id, frame_id);
  if (!layer_from_frame.ok()) return;
  layer_from_frame_ = *layer_from_frame;
  grid_ = AsGrid(layer);
}

absl::Status ExploredArea::Check(const Polygon& area, const Limits& limits) const {
  if (grid_ == nullptr || area.empty()) return absl::OkStatus();
  const Polygon in_layer = layer_from_frame_ * area;
  for (const Point& p : in_layer.outer()) {
    if (grid_->geometry().CellAt(p)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("free_space lies outside of what layer \"", layer_, "\" can hold"));
  }
  const CellCover cover(in_layer, grid_->geometry(), kAllCells, grid_->spec().explored_rule);
  if (cover.bounds().num_cells() <= limits.max_cells) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("free_space spans ", cover.bounds().num_cells(),
                                                   " cells of layer \"", layer_,
                                                   "\", --max_cells is ", limits.max_cells));
}

void ExploredArea::Mark(const Polygon& area, std::vector<Edit>* edits) const {
  Fill(area, kExplored, edits);
}

void ExploredArea::Forget(const Polygon& area, std::vector<Edit>* edits) const {
  Fill(area, std::nullopt, edits);
}

void ExploredArea::Fill(const Polygon& area, std::optional<double> value,
                        std::vector<Edit>* edits) const {
  if (grid_ == nullptr || area.empty()) return;
  edits->push_back(FillPolygon{layer_, area, frame_id_, grid_->spec().explored_rule, value});
}

}  // namespace hypermap::server
