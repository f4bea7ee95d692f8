#include "map/edits/batch_cells.h"

#include <algorithm>
#include <map>
#include <string>
#include <variant>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/frames/frame_bounds.h"
#include "map/grid/cell_cover.h"
#include "map/grid/tile.h"

namespace hypermap {
namespace {

constexpr int64_t kTilesOfSmallLimits = 64;

// Follows the frames and grids that the batch makes, and adds up the cells of its edits.
class CellCounter {
 public:
  CellCounter(const Snapshot& before, int64_t max_cells)
      : before_(before), frames_(before.frames), max_cells_(max_cells) {}

  template <typename OtherEdit>
  absl::Status operator()(const OtherEdit& /*edit*/) {
    return absl::OkStatus();
  }
  absl::Status operator()(const CreateLayer& edit) {
    if (!FindSpec(edit.spec.name)) specs_[edit.spec.name] = &edit.spec;
    return absl::OkStatus();
  }
  absl::Status operator()(const DeleteLayer& edit) {
    specs_[edit.layer] = nullptr;
    return absl::OkStatus();
  }
  absl::Status operator()(const SetTransform& edit) {
    FrameTransform transform = edit.transform;
    transform.parent_frame_id = OrOwnFrame(transform.parent_frame_id);
    // Apply refuses the others.
    if (frame_bounds_.Check(frames_, transform).ok()) frames_.Set(transform).IgnoreError();
    return absl::OkStatus();
  }
  absl::Status operator()(const WriteCells& edit) {
    const bool fits = kAllCells.Contains(edit.box) &&
                      static_cast<int64_t>(edit.values.size()) == edit.box.num_cells();
    return fits ? Add(edit.layer, edit.box) : absl::OkStatus();
  }
  absl::Status operator()(const FillPolygon& edit) {
    const LayerSpec* const spec = FindSpec(edit.layer);
    if (!spec || !spec->grid || edit.area.empty()) return absl::OkStatus();
    const std::string layer_frame = OrOwnFrame(spec->frame_id);
    const auto layer_from_area =
        frames_.Lookup(layer_frame, edit.frame_id.empty() ? layer_frame : edit.frame_id);
    if (!layer_from_area.ok()) return absl::OkStatus();
    const Polygon area = *layer_from_area * edit.area;
    const bool fits = std::all_of(area.outer().begin(), area.outer().end(), [&](const Point& p) {
      return spec->grid->CellAt(p).has_value();
    });
    if (!fits) return absl::OkStatus();
    return Add(edit.layer, CellCover::BoundsOf(area, *spec->grid, kAllCells));
  }

 private:
  const std::string& OrOwnFrame(const std::string& frame_id) const {
    return frame_id.empty() ? before_.frame_id : frame_id;
  }

  // Returns null if there is no such layer.
  const LayerSpec* FindSpec(const std::string& layer) const {
    if (const auto made = specs_.find(layer); made != specs_.end()) return made->second;
    const Layer* const known = before_.FindLayer(layer);
    return known ? &known->spec() : nullptr;
  }

  absl::Status Add(const std::string& layer, const CellBox& box) {
    if (box.empty()) return absl::OkStatus();
    num_cells_ += box.num_cells();
    if (num_cells_ > max_cells_) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the batch sets ", num_cells_,
                       " cells up to here, more than --max_cells = ", max_cells_));
    }
    return AddTiles(layer, TileOf({box.row_begin, box.col_begin}),
                    TileOf({box.row_end - 1, box.col_end - 1}));
  }

  // Tiles that several edits write count once.
  absl::Status AddTiles(const std::string& layer, const TileIndex& first, const TileIndex& last) {
    const int64_t max_tiles = MaxTiles(max_cells_);
    const int64_t num_new =
        (int64_t{last.row} - first.row + 1) * (int64_t{last.col} - first.col + 1);
    absl::flat_hash_set<TileIndex>& tiles = tiles_[layer];
    // Not inserted one by one if they are too many alone, so that the work is bounded, too.
    for (int32_t row = first.row; num_new <= max_tiles && row <= last.row; ++row) {
      for (int32_t col = first.col; col <= last.col; ++col) {
        if (tiles.insert({row, col}).second) ++num_tiles_;
      }
    }
    if (num_new <= max_tiles && num_tiles_ <= max_tiles) return absl::OkStatus();
    return absl::ResourceExhaustedError(
        absl::StrCat("the batch writes more than ", max_tiles, " tiles of ", kTileSide, " x ",
                     kTileSide, " cells up to here, the most with --max_cells = ", max_cells_));
  }

  const Snapshot& before_;
  FrameTree frames_;  // After the edits so far.
  FrameBounds frame_bounds_;
  const int64_t max_cells_;
  std::map<std::string, const LayerSpec*> specs_;  // Layers made by the batch. Null: deleted.
  int64_t num_cells_ = 0;
  std::map<std::string, absl::flat_hash_set<TileIndex>> tiles_;
  int64_t num_tiles_ = 0;
};

}  // namespace

int64_t MaxTiles(int64_t max_cells) { return max_cells / kCellsPerTile * 2 + kTilesOfSmallLimits; }

absl::Status CheckCells(const Snapshot& before, const EditBatch& batch, int64_t max_cells) {
  CellCounter counter(before, max_cells);
  for (size_t i = 0; i < batch.edits.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const absl::Status status = std::visit(counter, batch.edits[i]);
    if (!status.ok()) {
      return absl::Status(status.code(), absl::StrCat("edits[", i, "]: ", status.message()));
    }
  }
  return absl::OkStatus();
}

}  // namespace hypermap
