// A square block of cells: the unit in which grids are shared, copied and stored.
#ifndef HYPERMAP_MAP_GRID_TILE_H_
#define HYPERMAP_MAP_GRID_TILE_H_

#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include "base/digest/set_digest.h"
#include "map/grid/grid_geometry.h"

namespace hypermap {

// The stored form of a cell's value. The layer kind defines its meaning (see CellDomain), except
// that kUnknownCode (NaN) always means unknown. Codes are compared by value; all NaNs are equal.
using CellCode = float;
inline constexpr CellCode kUnknownCode = std::numeric_limits<float>::quiet_NaN();
inline bool IsUnknown(CellCode code) { return code != code; }
inline bool SameCode(CellCode a, CellCode b) { return a == b || (IsUnknown(a) && IsUnknown(b)); }

// Index of a tile, which contains the cells with row / kTileSide == row and col / kTileSide == col
// (division rounds down).
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
// Returns the position of a cell in TileCodes.
inline int32_t CellInTile(int32_t row_in_tile, int32_t col_in_tile) {
  return row_in_tile * kTileSide + col_in_tile;
}

class Tile;
using TilePtr = std::shared_ptr<const Tile>;

// kTileSide x kTileSide cells. Immutable; safe to read from many threads.
//
// A tile with at most 256 different codes, as most have, stores one byte per cell, an index of its
// codes. This takes a quarter of the memory, and a quarter of the cache misses of a query. A tile
// with one code, as fills make them, stores this code only.
class Tile {
 public:
  static TilePtr Make(const TileCodes& codes);

  Tile(const Tile&) = delete;
  Tile& operator=(const Tile&) = delete;

  CellCode at(int32_t row_in_tile, int32_t col_in_tile) const {
    return CodeOf(CellInTile(row_in_tile, col_in_tile));
  }
  // Returns a copy of all codes. Unknown cells may have another NaN than was written.
  TileCodes codes() const;
  // Returns whether every cell has the same code as in `codes`.
  bool Holds(const TileCodes& codes) const;

  // Bytes of memory that the tile takes.
  int64_t ByteSize() const;

  // Returns the first column in (col, end) whose code differs from that of `col`, or `end`.
  int32_t EndOfRun(int32_t row_in_tile, int32_t col, int32_t end) const;

  // Returns whether the columns begin <= col < end of two rows have the same codes. May return
  // false if they differ only in the sign of a zero or in the bits of a NaN.
  bool HasSameCells(int32_t row_in_tile, int32_t other_row, int32_t begin, int32_t end) const;

  // The digest of the cells by `digest_of`, which must always be the same function: what it returns
  // is kept.
  SetDigest Digest(SetDigest (*digest_of)(const Tile&)) const {
    return digest_.Get([&] { return digest_of(*this); });
  }

  // Prefetches the columns begin <= col < end of a row.
  void Prefetch(int32_t row_in_tile, int32_t begin, int32_t end) const;

 protected:
  // Cell i has code codes[i], or codes[bytes[i]] if `bytes` is not null. Both arrays belong to the
  // subclass.
  Tile(const CellCode* codes, const uint8_t* bytes) : codes_(codes), bytes_(bytes) {}
  ~Tile() = default;

 private:
  // The stored form of the cells, for functions that need not know the codes.
  struct Raw {
    const char* cells;
    int64_t size;  // Bytes of a cell.
    const char* at(int32_t row_in_tile, int32_t col_in_tile) const {
      return cells + CellInTile(row_in_tile, col_in_tile) * size;
    }
  };
  Raw raw() const;

  CellCode CodeOf(int32_t cell) const { return codes_[bytes_ ? bytes_[cell] : cell]; }

  const CellCode* const codes_;
  const uint8_t* const bytes_;
  KeptDigest digest_;
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
