#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"

namespace hypermap {

GridWriter::GridWriter(std::shared_ptr<const GridLayer> layer)
    : layer_(std::move(layer)), extent_(layer_->extent()) {}

TileCodes& GridWriter::MutableCodes(const TileIndex& index) {
  std::unique_ptr<TileCodes>& codes = dirty_[index];
  if (!codes) {
    const auto before = layer_->tiles().find(index);
    if (before == layer_->tiles().end()) {
      codes = std::make_unique<TileCodes>();
      codes->fill(kUnknownCode);
    } else {
      codes = std::make_unique<TileCodes>(before->second->codes());
    }
  }
  return *codes;
}

void GridWriter::SetSpan(int32_t row, int32_t col_begin, int32_t col_end, CellCode code) {
  for (int32_t col = col_begin; col < col_end;) {
    const TileIndex index = TileOf({row, col});
    const CellBox cells = CellsOf(index);
    TileCodes& codes = MutableCodes(index);
    for (; col < col_end && col < cells.col_end; ++col) {
      codes[CellInTile(row - cells.row_begin, col - cells.col_begin)] = code;
    }
  }
}

absl::Status GridWriter::Write(const CellBox& box,
                               const std::vector<std::optional<double>>& values) {
  if (box.empty()) return absl::InvalidArgumentError("box holds no cell");
  if (!kAllCells.Contains(box)) {
    return absl::InvalidArgumentError(absl::StrCat("box leaves the cells with indices in [",
                                                   -kMaxCellIndex, ", ", kMaxCellIndex, ")"));
  }
  if (static_cast<int64_t>(values.size()) != box.num_cells()) {
    return absl::InvalidArgumentError(absl::StrCat("values has ", values.size(), " entries for ",
                                                   box.num_cells(), " cells of the box"));
  }
  std::vector<CellCode> codes;
  codes.reserve(values.size());
  for (const std::optional<double>& value : values) {
    if (!value) {
      codes.push_back(kUnknownCode);
      continue;
    }
    const absl::StatusOr<CellCode> code = layer_->domain().Encode(*value);
    if (!code.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat("values[", codes.size(), "]: ", code.status().message()));
    }
    codes.push_back(*code);
  }
  size_t next = 0;
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end;) {
      const TileIndex index = TileOf({row, col});
      const CellBox cells = CellsOf(index);
      TileCodes& tile = MutableCodes(index);
      for (; col < box.col_end && col < cells.col_end; ++col) {
        tile[CellInTile(row - cells.row_begin, col - cells.col_begin)] = codes[next++];
      }
    }
  }
  extent_ = extent_.Union(box);
  return absl::OkStatus();
}

absl::Status GridWriter::Fill(const Polygon& area, CellRule rule, std::optional<double> value,
                              int64_t max_cells) {
  CellCode code = kUnknownCode;
  if (value) {
    HYPERMAP_ASSIGN_OR_RETURN(const CellCode encoded, layer_->domain().Encode(*value));
    code = encoded;
  }
  const GridGeometry& geometry = layer_->geometry();
  for (const Point& p : area.outer()) {
    if (!geometry.CellAt(p)) {
      return absl::InvalidArgumentError(absl::StrCat("area leaves the cells with indices in [",
                                                     -kMaxCellIndex, ", ", kMaxCellIndex, ")"));
    }
  }
  const CellCover cover(area, geometry, kAllCells, rule);
  const CellBox& bounds = cover.bounds();
  if (bounds.num_cells() > max_cells) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "area's box holds ", bounds.num_cells(), " cells, more than --max_cells = ", max_cells));
  }
  for (int32_t row = bounds.row_begin; row < bounds.row_end; ++row) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    for (const ColumnSpan& span : cover.SpansOfRow(row)) {
      SetSpan(row, span.col_begin, span.col_end, code);
      extent_ = extent_.Union({row, row + 1, span.col_begin, span.col_end});
    }
  }
  return absl::OkStatus();
}

GridWriter::Result GridWriter::Finish() && {
  TileMap tiles = layer_->tiles();
  WrittenTiles written;
  for (auto& [index, dirty] : dirty_) {
    if (IsCancelled()) break;
    // Freed at once, so that a tile does not take the memory of both forms.
    const std::unique_ptr<TileCodes> codes = std::move(dirty);
    const auto slot = tiles.find(index);
    const TilePtr before = slot == tiles.end() ? nullptr : slot->second;
    // No tile means that all cells are unknown.
    const bool is_same =
        before ? before->Holds(*codes) : std::all_of(codes->begin(), codes->end(), IsUnknown);
    if (is_same) continue;
    written[index] = {before, tiles[index] = Tile::Make(*codes)};
  }
  auto layer = std::make_shared<const GridLayer>(layer_->spec(), layer_->shared_domain(),
                                                 std::move(tiles), extent_);
  return {std::move(layer), std::move(written)};
}

}  // namespace hypermap
