#include "map/grid/tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>

namespace hypermap {
namespace {

constexpr int kLine = 64;  // Bytes of a cache line.

// Numbers the codes of a tile in the order of their first appearance.
class Palette {
 public:
  // Returns nullopt if the tile has more codes than a byte can number, or a negative zero: it
  // equals zero as a code, but readers must get the sign that was written.
  std::optional<uint8_t> NumberOf(CellCode code) {
    const uint32_t bits = std::bit_cast<uint32_t>(IsUnknown(code) ? kUnknownCode : code);
    if (size_ > 0 && bits == last_bits_) return last_;
    if (bits == std::bit_cast<uint32_t>(CellCode{-0.0F})) return std::nullopt;
    uint32_t slot = (bits * 2654435761U) >> (32 - kSlotBits);
    while (slots_[slot] != 0 && std::bit_cast<uint32_t>(codes_[slots_[slot] - 1]) != bits) {
      slot = (slot + 1) % slots_.size();
    }
    if (slots_[slot] == 0) {
      if (size_ == codes_.size()) return std::nullopt;
      codes_[size_] = std::bit_cast<CellCode>(bits);
      slots_[slot] = static_cast<uint16_t>(++size_);
    }
    last_bits_ = bits;
    last_ = static_cast<uint8_t>(slots_[slot] - 1);
    return last_;
  }

  const std::array<CellCode, 256>& codes() const { return codes_; }
  size_t size() const { return size_; }

 private:
  static constexpr int kSlotBits = 10;

  std::array<CellCode, 256> codes_{};
  size_t size_ = 0;
  std::array<uint16_t, 1 << kSlotBits> slots_{};  // Number + 1 of a code; 0: free slot.
  uint32_t last_bits_ = 0;
  uint8_t last_ = 0;
};

class NarrowTile final : public Tile {
 public:
  using Bytes = std::array<uint8_t, kCellsPerTile>;

  NarrowTile(const std::array<CellCode, 256>& codes, const Bytes& bytes)
      : Tile(own_codes_, own_bytes_) {
    std::copy(codes.begin(), codes.end(), own_codes_);
    std::copy(bytes.begin(), bytes.end(), own_bytes_);
  }

 private:
  CellCode own_codes_[256];
  alignas(kLine) uint8_t own_bytes_[kCellsPerTile];
};

// The bytes of all tiles whose cells have one code.
alignas(kLine) constexpr NarrowTile::Bytes kSameCode{};

// Fills make many tiles with one code, which need no memory for their cells.
class UniformTile final : public Tile {
 public:
  explicit UniformTile(CellCode code) : Tile(&own_code_, kSameCode.data()), own_code_(code) {}

 private:
  CellCode own_code_;
};

class WideTile final : public Tile {
 public:
  explicit WideTile(const TileCodes& codes) : Tile(own_codes_, nullptr) {
    std::copy(codes.begin(), codes.end(), own_codes_);
  }

 private:
  alignas(kLine) CellCode own_codes_[kCellsPerTile];
};

// Returns the first byte from `begin` on that differs from `byte`, or `end`. Compares eight at a
// time.
const uint8_t* FirstOther(const uint8_t* begin, const uint8_t* end, uint8_t byte) {
  const uint64_t pattern = byte * 0x0101010101010101U;
  for (; end - begin >= 8; begin += 8) {
    uint64_t eight = 0;
    std::memcpy(&eight, begin, sizeof eight);
    const uint64_t difference = eight ^ pattern;
    if (difference == 0) continue;
    const bool low_first = std::endian::native == std::endian::little;
    return begin + (low_first ? std::countr_zero(difference) : std::countl_zero(difference)) / 8;
  }
  while (begin < end && *begin == byte) ++begin;
  return begin;
}

}  // namespace

TilePtr Tile::Make(const TileCodes& codes) {
  Palette palette;
  NarrowTile::Bytes bytes;
  for (int32_t cell = 0; cell < kCellsPerTile; ++cell) {
    const std::optional<uint8_t> number = palette.NumberOf(codes[cell]);
    if (!number) return std::make_shared<WideTile>(codes);
    bytes[cell] = *number;
  }
  if (palette.size() == 1) return std::make_shared<UniformTile>(palette.codes().front());
  return std::make_shared<NarrowTile>(palette.codes(), bytes);
}

int64_t Tile::ByteSize() const {
  if (bytes_ == nullptr) return sizeof(WideTile);
  return bytes_ == kSameCode.data() ? sizeof(UniformTile) : sizeof(NarrowTile);
}

TileCodes Tile::codes() const {
  TileCodes codes;
  for (int32_t cell = 0; cell < kCellsPerTile; ++cell) codes[cell] = CodeOf(cell);
  return codes;
}

bool Tile::Holds(const TileCodes& codes) const {
  for (int32_t cell = 0; cell < kCellsPerTile; ++cell) {
    if (!SameCode(CodeOf(cell), codes[cell])) return false;
  }
  return true;
}

int32_t Tile::EndOfRun(int32_t row_in_tile, int32_t col, int32_t end) const {
  const int32_t row = CellInTile(row_in_tile, 0);
  if (bytes_ != nullptr) {
    const uint8_t* const bytes = bytes_ + row;
    return static_cast<int32_t>(FirstOther(bytes + col + 1, bytes + end, bytes[col]) - bytes);
  }
  const CellCode* const codes = codes_ + row;
  const CellCode code = codes[col++];
  if (IsUnknown(code)) {
    while (col < end && IsUnknown(codes[col])) ++col;
  } else {
    while (col < end && codes[col] == code) ++col;
  }
  return col;
}

bool Tile::HasSameCells(int32_t row_in_tile, int32_t other_row, int32_t begin, int32_t end) const {
  const Raw raw = this->raw();
  return std::memcmp(raw.at(row_in_tile, begin), raw.at(other_row, begin),
                     (end - begin) * raw.size) == 0;
}

Tile::Raw Tile::raw() const {
  if (bytes_ != nullptr) return {reinterpret_cast<const char*>(bytes_), sizeof *bytes_};
  return {reinterpret_cast<const char*>(codes_), sizeof *codes_};
}

void Tile::Prefetch(int32_t row_in_tile, int32_t begin, int32_t end) const {
  const Raw raw = this->raw();
  const char* const last = raw.at(row_in_tile, end) - 1;
  for (const char* line = raw.at(row_in_tile, begin); line < last; line += kLine) {
    __builtin_prefetch(line);
  }
  __builtin_prefetch(last);
}

}  // namespace hypermap
