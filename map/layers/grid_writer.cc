#include <algorithm>
#include <bit>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"

namespace hypermap {
namespace {

// Tiles that are unpacked at once: 64 KB each.
constexpr size_t kMaxUnpacked = 512;

bool AreUnknown(const TileCodes& codes) {
  return std::all_of(codes.begin(), codes.end(), IsUnknown);
}

bool IsUniform(const Tile& tile, CellCode code) {
  for (int32_t row = 0; row < kTileSide; ++row) {
    if (!SameCode(tile.at(row, 0), code)) return false;
    if (tile.EndOfRun(row, 0, kTileSide) != kTileSide) return false;
  }
  return true;
}

// Unlike SameCode, distinguishes zeros by their signs.
bool HasSameBits(CellCode a, CellCode b) {
  return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b);
}

TilePtr MakeUniform(CellCode code) {
  const auto codes = std::make_unique<TileCodes>();
  codes->fill(code);
  return Tile::Make(*codes);
}

}  // namespace

// Fills the selected cells of one row of tiles, tile by tile.
class GridWriter::BandFill {
 public:
  // Fills cells of the rows row_begin <= row < row_end, which one row of tiles holds.
  BandFill(GridWriter* writer, int32_t row_begin, int32_t row_end, CellCode code)
      : writer_(writer), row_begin_(row_begin), code_(code), rows_(row_end - row_begin) {}

  absl::Status Run(const CellCover& cover) {
    int32_t col_begin = kMaxCellIndex;
    int32_t col_end = -kMaxCellIndex;
    for (size_t i = 0; i < rows_.size(); ++i) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      const int32_t row = row_begin_ + static_cast<int32_t>(i);
      rows_[i].spans = cover.SpansOfRow(row);
      if (rows_[i].spans.empty()) continue;
      col_begin = std::min(col_begin, rows_[i].spans.front().col_begin);
      col_end = std::max(col_end, rows_[i].spans.back().col_end);
      writer_->extent_ = writer_->extent_.Union(
          {row, row + 1, rows_[i].spans.front().col_begin, rows_[i].spans.back().col_end});
    }
    if (col_begin >= col_end) return absl::OkStatus();
    const TileIndex last = TileOf({row_begin_, col_end - 1});
    for (TileIndex index = TileOf({row_begin_, col_begin}); index.col <= last.col; ++index.col) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      FillTile(index);
      HYPERMAP_RETURN_IF_ERROR(writer_->CheckGrowth());
    }
    return absl::OkStatus();
  }

 private:
  struct Row {
    ColumnSpans spans;
    size_t next = 0;  // The first span that does not end before the tile.
  };

  void FillTile(const TileIndex& index) {
    const CellBox cells = CellsOf(index);
    bool is_empty = true;
    bool is_whole = rows_.size() == kTileSide;
    for (Row& row : rows_) {
      while (row.next < row.spans.size() && row.spans[row.next].col_end <= cells.col_begin) {
        ++row.next;
      }
      const bool meets =
          row.next < row.spans.size() && row.spans[row.next].col_begin < cells.col_end;
      is_empty = is_empty && !meets;
      is_whole = is_whole && meets && row.spans[row.next].col_begin <= cells.col_begin &&
                 row.spans[row.next].col_end >= cells.col_end;
    }
    if (is_whole) return writer_->SetUniform(index, code_);
    if (!is_empty) FillSome(cells, writer_->MutableCodes(index));
  }

  void FillSome(const CellBox& cells, TileCodes& codes) {
    for (size_t i = 0; i < rows_.size(); ++i) {
      const int32_t row = row_begin_ + static_cast<int32_t>(i) - cells.row_begin;
      for (size_t s = rows_[i].next; s < rows_[i].spans.size(); ++s) {
        const ColumnSpan& span = rows_[i].spans[s];
        if (span.col_begin >= cells.col_end) break;
        const int32_t begin = std::max(span.col_begin, cells.col_begin) - cells.col_begin;
        const int32_t end = std::min(span.col_end, cells.col_end) - cells.col_begin;
        std::fill_n(codes.begin() + CellInTile(row, begin), end - begin, code_);
      }
    }
  }

  GridWriter* const writer_;
  const int32_t row_begin_;
  const CellCode code_;
  std::vector<Row> rows_;
};

GridWriter::GridWriter(std::shared_ptr<const GridLayer> layer)
    : layer_(std::move(layer)), extent_(layer_->extent()) {}

GridWriter::Dirty& GridWriter::DirtyAt(const TileIndex& index) {
  const auto [dirty, is_new] = dirty_.try_emplace(index);
  if (is_new) {
    const auto before = layer_->tiles().find(index);
    if (before != layer_->tiles().end()) dirty->second.before = before->second;
    dirty->second.packed = dirty->second.before;
  }
  return dirty->second;
}

TileCodes& GridWriter::MutableCodes(const TileIndex& index) {
  Dirty& dirty = DirtyAt(index);
  if (!dirty.codes) {
    if (unpacked_.size() >= kMaxUnpacked) Pack();
    if (dirty.packed) {
      dirty.codes = std::make_unique<TileCodes>(dirty.packed->codes());
    } else {
      dirty.codes = std::make_unique<TileCodes>();
      dirty.codes->fill(kUnknownCode);
    }
    unpacked_.push_back(index);
  }
  return *dirty.codes;
}

void GridWriter::SetUniform(const TileIndex& index, CellCode code) {
  Dirty& dirty = DirtyAt(index);
  dirty.codes = nullptr;
  if (dirty.before ? IsUniform(*dirty.before, code) : IsUnknown(code)) {
    return SetPacked(dirty.before, &dirty);
  }
  if (!uniform_ || !HasSameBits(uniform_->at(0, 0), code)) uniform_ = MakeUniform(code);
  SetPacked(uniform_, &dirty);
}

void GridWriter::SetPacked(TilePtr tile, Dirty* dirty) {
  growth_ += BytesInGrid(tile.get()) - BytesInGrid(dirty->packed.get());
  dirty->packed = std::move(tile);
}

void GridWriter::Pack() {
  for (const TileIndex& index : unpacked_) {
    if (IsCancelled()) return;
    Dirty& dirty = dirty_.find(index)->second;
    if (!dirty.codes) continue;
    // Freed at once, so that a tile does not take the memory of both forms.
    const std::unique_ptr<TileCodes> codes = std::move(dirty.codes);
    // No tile means that all cells are unknown.
    const bool is_same = dirty.before ? dirty.before->Holds(*codes) : AreUnknown(*codes);
    SetPacked(is_same ? dirty.before : Tile::Make(*codes), &dirty);
  }
  unpacked_.clear();
}

absl::Status GridWriter::CheckGrowth() const {
  if (growth_ <= max_growth_) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "its cells take more than the ", std::max<int64_t>(0, max_growth_),
      " bytes of memory by which --max_content_bytes lets the content of the map grow"));
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
  constexpr size_t kValuesPerLook = 4'096;
  std::vector<CellCode> codes;
  codes.reserve(values.size());
  for (const std::optional<double>& value : values) {
    if (codes.size() % kValuesPerLook == 0) HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
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
  // Tile by tile, so that each is unpacked once.
  const TileIndex last = TileOf({box.row_end - 1, box.col_end - 1});
  for (TileIndex index = TileOf({box.row_begin, box.col_begin}); index.row <= last.row;
       ++index.row) {
    for (index.col = TileOf({box.row_begin, box.col_begin}).col; index.col <= last.col;
         ++index.col) {
      const CellBox cells = CellsOf(index);
      const CellBox part = box.Intersection(cells);
      TileCodes& tile = MutableCodes(index);
      for (int32_t row = part.row_begin; row < part.row_end; ++row) {
        const auto from =
            codes.begin() + (row - box.row_begin) * box.cols() + (part.col_begin - box.col_begin);
        std::copy_n(
            from, part.cols(),
            tile.begin() + CellInTile(row - cells.row_begin, part.col_begin - cells.col_begin));
      }
      HYPERMAP_RETURN_IF_ERROR(CheckGrowth());
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
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
  for (int32_t row = bounds.row_begin; row < bounds.row_end;) {
    const int32_t end = std::min(CellsOf(TileOf({row, 0})).row_end, bounds.row_end);
    HYPERMAP_RETURN_IF_ERROR(BandFill(this, row, end, code).Run(cover));
    row = end;
  }
  return absl::OkStatus();
}

GridWriter::Result GridWriter::Finish() && {
  Pack();
  TileMap tiles = layer_->tiles();
  WrittenTiles written;
  for (auto& [index, dirty] : dirty_) {
    // A tile may still be unpacked if the work was given up.
    if (dirty.packed == dirty.before || IsCancelled()) continue;
    tiles[index] = dirty.packed;
    written[index] = {std::move(dirty.before), std::move(dirty.packed)};
  }
  std::shared_ptr<const GridLayer> layer(
      new GridLayer(*layer_, std::move(tiles), extent_, layer_->ByteSize() + growth_));
  return {std::move(layer), std::move(written)};
}

}  // namespace hypermap
