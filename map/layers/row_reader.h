// Reads the rows of a grid across its tiles. Private to this folder.
#ifndef HYPERMAP_MAP_LAYERS_ROW_READER_H_
#define HYPERMAP_MAP_LAYERS_ROW_READER_H_

#include <algorithm>
#include <cstdint>

#include "map/grid/column_span.h"
#include "map/grid/tile.h"
#include "map/layers/grid_layer.h"

namespace hypermap {

// Reads one row at a time. Finds the first tile of a row at once if a row that was read lately
// begins in it, also when rows of the next row of tiles are prefetched in between. The tiles must
// outlive the reader. Used by one thread.
class RowReader {
 public:
  explicit RowReader(const TileMap& tiles) : tiles_(tiles), end_(tiles.end()), found_{end_, end_} {}

  // Calls `visit(col_begin, col_end, code)`, left to right, for the maximal runs of equal codes
  // within each tile, and for the gaps between tiles as unknown.
  template <typename VisitRun>
  void Visit(int32_t row, const ColumnSpan& span, VisitRun visit) {
    int32_t col = span.col_begin;
    VisitTiles(row, span,
               [&](const Tile& tile, int32_t row_in_tile, int32_t first, const ColumnSpan& part) {
                 if (col < part.col_begin) visit(col, part.col_begin, kUnknownCode);
                 for (col = part.col_begin; col < part.col_end;) {
                   const int32_t begin = col;
                   col = first + tile.EndOfRun(row_in_tile, begin - first, part.col_end - first);
                   visit(begin, col, tile.at(row_in_tile, begin - first));
                 }
               });
    if (col < span.col_end) visit(col, span.col_end, kUnknownCode);
  }

  // Returns whether Visit would find the same in this row and in the row before. False may also
  // mean that finding out is too expensive.
  bool IsLikeTheRowBefore(int32_t row, const ColumnSpan& span) {
    if (row % kTileSide == 0) return false;  // Its row before is in other tiles.
    bool is_like = true;
    VisitTiles(row, span,
               [&](const Tile& tile, int32_t row_in_tile, int32_t first, const ColumnSpan& part) {
                 is_like =
                     is_like && tile.HasSameCells(row_in_tile, row_in_tile - 1,
                                                  part.col_begin - first, part.col_end - first);
               });
    return is_like;
  }

  // Prefetches the cells that Visit would read.
  void Prefetch(int32_t row, const ColumnSpan& span) {
    VisitTiles(row, span,
               [](const Tile& tile, int32_t row_in_tile, int32_t first, const ColumnSpan& part) {
                 tile.Prefetch(row_in_tile, part.col_begin - first, part.col_end - first);
               });
  }

 private:
  // Calls `visit(tile, row in the tile, first column of the tile, part of the span in the tile)`,
  // left to right.
  template <typename VisitTile>
  void VisitTiles(int32_t row, const ColumnSpan& span, VisitTile visit) {
    const int32_t tile_row = FloorDiv(row, kTileSide);
    const TileIndex index{tile_row, FloorDiv(span.col_begin, kTileSide)};
    TileMap::const_iterator& found = found_[tile_row & 1];
    if (found == end_ || found->first != index) found = tiles_.lower_bound(index);
    for (auto tile = found; tile != end_ && tile->first.row == tile_row; ++tile) {
      const int32_t first = tile->first.col * kTileSide;
      if (first >= span.col_end) break;
      visit(*tile->second, row - tile_row * kTileSide, first,
            ColumnSpan{std::max(span.col_begin, first), std::min(span.col_end, first + kTileSide)});
      if (first + kTileSide >= span.col_end) break;
    }
  }

  const TileMap& tiles_;
  const TileMap::const_iterator end_;
  // The first tile of the row read last, for even and for odd rows of tiles.
  TileMap::const_iterator found_[2];
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_ROW_READER_H_
