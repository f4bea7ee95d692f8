#include "map/layers/changed_parts.h"

#include <algorithm>

#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Iterates over the tiles of one row, within a range of columns.
class TilesOfRow {
 public:
  TilesOfRow(const TileMap& tiles, int32_t row, int32_t col_begin, int32_t col_end)
      : end_(tiles.end()), next_(tiles.lower_bound({row, col_begin})), last_{row, col_end} {}

  // The column of the next tile, or the end of the range if there is none.
  int32_t col() const {
    return next_ == end_ || next_->first >= last_ ? last_.col : next_->first.col;
  }
  // Returns the next tile and advances, if that tile is in column `col`; otherwise returns null.
  const Tile* Take(int32_t col) {
    if (this->col() != col) return nullptr;
    return (next_++)->second.get();
  }

 private:
  const TileMap::const_iterator end_;
  TileMap::const_iterator next_;
  const TileIndex last_;
};

CellCode CodeOf(const Tile* tile, int32_t row, int32_t col) {
  return tile == nullptr ? kUnknownCode : tile->at(row, col);
}

CellBox ChangedPart(const TileIndex& index, const Tile* before, const Tile* after,
                    const CellBox& within) {
  const CellBox cells = CellsOf(index);
  const CellBox part = within.Intersection(cells);
  CellBox changed;
  for (int32_t row = part.row_begin; row < part.row_end; ++row) {
    for (int32_t col = part.col_begin; col < part.col_end; ++col) {
      const int32_t r = row - cells.row_begin;
      const int32_t c = col - cells.col_begin;
      if (SameCode(CodeOf(before, r, c), CodeOf(after, r, c))) continue;
      changed = changed.Union({row, row + 1, col, col + 1});
    }
  }
  return changed;
}

}  // namespace

std::vector<CellBox> ChangedParts(const GridLayer& before, const GridLayer& after,
                                  const CellBox& within) {
  std::vector<CellBox> parts;
  if (&before == &after || within.empty()) return parts;
  const TileIndex first = TileOf({within.row_begin, within.col_begin});
  const TileIndex last = TileOf({within.row_end - 1, within.col_end - 1});
  const int32_t col_end = last.col + 1;
  for (int32_t row = first.row; row <= last.row; ++row) {
    TilesOfRow of_before(before.tiles(), row, first.col, col_end);
    TilesOfRow of_after(after.tiles(), row, first.col, col_end);
    while (true) {
      if (IsCancelled()) return parts;
      const int32_t col = std::min(of_before.col(), of_after.col());
      if (col == col_end) break;
      const Tile* was = of_before.Take(col);
      const Tile* is = of_after.Take(col);
      if (was == is) continue;
      const CellBox part = ChangedPart({row, col}, was, is, within);
      if (!part.empty()) parts.push_back(part);
    }
  }
  return parts;
}

}  // namespace hypermap
