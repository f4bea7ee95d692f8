// A square block of cells, the unit in which grids are shared, copied and stored.
#ifndef HYPERMAP_MAP_GRID_TILE_H_
#define HYPERMAP_MAP_GRID_TILE_H_

#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include "map/grid/grid_geometry.h"

namespace hypermap {

// The stored form of a cell's value. Its meaning is the layer kind's (see CellDomain); kUnknownCode
// (NaN) always means unknown. Codes are compared by value; every NaN is the same unknown.
using CellCode = float;
inline constexpr CellCode kUnknownCode = std::numeric_limits<float>::quiet_NaN();
inline bool IsUnknown(CellCode code) { return code != code; }
inline bool SameCode(CellCode a, CellCode b) { return a == b || (IsUnknown(a) && IsUnknown(b)); }

// Which tile: holds the cells with row / kTileSide == row and col / kTileSide == col (floored).
struct TileIndex {
  int32_t row = 0;
  int32_t col = 0;

  friend auto operator<=>(const TileIndex&, const TileIndex&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const TileIndex& t) {
    return H::combine(std::move(h), t.row, t.col);
  }
};

inline constexpr int32_t kTileSide = 128;
inline constexpr int32_t kCellsPerTile = kTileSide * kTileSide;

// The codes of a tile's cells, row-major, lowest row first.
using TileCodes = std::array<CellCode, kCellsPerTile>;
// Where in them a cell stands.
inline int32_t CellInTile(int32_t row_in_tile, int32_t col_in_tile) {
  return row_in_tile * kTileSide + col_in_tile;
}

class Tile;
using TilePtr = std::shared_ptr<const Tile>;

// kTileSide x kTileSide cells. Immutable, safe to read from many threads.
//
// A tile of few different codes, as most are, holds a byte for each cell that stands for its code:
// a quarter of the memory, and of what a question has to wait for.
class Tile {
 public:
  static TilePtr Make(const TileCodes& codes);

  Tile(const Tile&) = delete;
  Tile& operator=(const Tile&) = delete;

  CellCode at(int32_t row_in_tile, int32_t col_in_tile) const {
    return CodeOf(CellInTile(row_in_tile, col_in_tile));
  }
  // A copy of all codes; unknown ones may be another NaN than was given.
  TileCodes codes() const;
  // Whether every cell has the same code.
  bool Holds(const TileCodes& codes) const;

  // The first column after `col` and before `end` whose code is not that of `col`, else `end`.
  int32_t EndOfRun(int32_t row_in_tile, int32_t col, int32_t end) const;

  // Whether the columns begin <= col < end of two rows have the same codes; false may also mean
  // that their zeros or NaNs differ.
  bool HasSameCells(int32_t row_in_tile, int32_t other_row, int32_t begin, int32_t end) const;

  // Asks the memory for the columns begin <= col < end of a row, which are read soon.
  void Prefetch(int32_t row_in_tile, int32_t begin, int32_t end) const;

 protected:
  // Cell i has code codes[i], or codes[bytes[i]] when there are bytes. They live in the tile.
  Tile(const CellCode* codes, const uint8_t* bytes) : codes_(codes), bytes_(bytes) {}
  ~Tile() = default;

 private:
  // The stored form of cells, for those who don't care for its meaning.
  struct Raw {
    const char* cells;
    int64_t size;  // of a cell
    const char* at(int32_t row_in_tile, int32_t col_in_tile) const {
      return cells + CellInTile(row_in_tile, col_in_tile) * size;
    }
  };
  Raw raw() const;

  CellCode CodeOf(int32_t cell) const { return codes_[bytes_ ? bytes_[cell] : cell]; }

  const CellCode* const codes_;
  const uint8_t* const bytes_;
};

inline int32_t FloorDiv(int32_t a, int32_t b) { return a / b - (a % b < 0 ? 1 : 0); }
inline TileIndex TileOf(const CellIndex& c) {
  return {FloorDiv(c.row, kTileSide), FloorDiv(c.col, kTileSide)};
}
inline CellBox CellsOf(const TileIndex& t) {
  return {t.row * kTileSide, (t.row + 1) * kTileSide, t.col * kTileSide, (t.col + 1) * kTileSide};
}

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_TILE_H_
