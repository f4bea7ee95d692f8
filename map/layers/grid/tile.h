// A square block of cells, the unit in which grids are shared, copied and stored.
#ifndef HYPERMAP_MAP_LAYERS_GRID_TILE_H_
#define HYPERMAP_MAP_LAYERS_GRID_TILE_H_

#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include "map/layers/grid/grid_geometry.h"

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

// kTileSide x kTileSide cells, row-major, lowest row first. Immutable once shared.
class Tile {
 public:
  Tile() { codes_.fill(kUnknownCode); }

  CellCode at(int32_t row_in_tile, int32_t col_in_tile) const {
    return codes_[row_in_tile * kTileSide + col_in_tile];
  }
  void set(int32_t row_in_tile, int32_t col_in_tile, CellCode code) {
    codes_[row_in_tile * kTileSide + col_in_tile] = code;
  }
  const std::array<CellCode, kTileSide * kTileSide>& codes() const { return codes_; }
  std::array<CellCode, kTileSide * kTileSide>& mutable_codes() { return codes_; }

 private:
  std::array<CellCode, kTileSide * kTileSide> codes_;
};

using TilePtr = std::shared_ptr<const Tile>;

inline int32_t FloorDiv(int32_t a, int32_t b) { return a / b - (a % b < 0 ? 1 : 0); }
inline TileIndex TileOf(const CellIndex& c) {
  return {FloorDiv(c.row, kTileSide), FloorDiv(c.col, kTileSide)};
}
inline CellBox CellsOf(const TileIndex& t) {
  return {t.row * kTileSide, (t.row + 1) * kTileSide, t.col * kTileSide, (t.col + 1) * kTileSide};
}

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_TILE_H_
