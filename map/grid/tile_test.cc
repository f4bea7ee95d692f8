#include "map/grid/tile.h"

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

uint32_t Bits(CellCode code) { return std::bit_cast<uint32_t>(code); }

// Returns runs of up to `longest` cells, each with one of `codes`.
TileCodes RandomCodes(Rng& rng, const std::vector<CellCode>& codes, int longest) {
  TileCodes cells;
  for (int32_t cell = 0; cell < kCellsPerTile;) {
    const CellCode code = codes[UniformInt(rng, 0, static_cast<int>(codes.size()) - 1)];
    const int32_t end = std::min(kCellsPerTile, cell + UniformInt(rng, 1, longest));
    while (cell < end) cells[cell++] = code;
  }
  return cells;
}

int32_t EndOfRunByBruteForce(const TileCodes& codes, int32_t row, int32_t col, int32_t end) {
  const CellCode code = codes[CellInTile(row, col)];
  do {
    ++col;
  } while (col < end && SameCode(codes[CellInTile(row, col)], code));
  return col;
}

void ExpectTileOf(const TileCodes& codes, Rng& rng) {
  const TilePtr tile = Tile::Make(codes);
  EXPECT_TRUE(tile->Holds(codes));
  const TileCodes copy = tile->codes();
  for (int32_t cell = 0; cell < kCellsPerTile; ++cell) {
    const CellCode at = tile->at(cell / kTileSide, cell % kTileSide);
    ASSERT_TRUE(IsUnknown(codes[cell]) ? IsUnknown(at) : Bits(at) == Bits(codes[cell])) << cell;
    ASSERT_TRUE(SameCode(copy[cell], codes[cell])) << cell;
  }
  for (int i = 0; i < 2000; ++i) {
    const int32_t row = UniformInt(rng, 0, kTileSide - 1);
    const int32_t col = UniformInt(rng, 0, kTileSide - 1);
    const int32_t end = UniformInt(rng, col + 1, kTileSide);
    ASSERT_EQ(tile->EndOfRun(row, col, end), EndOfRunByBruteForce(codes, row, col, end))
        << "row " << row << " from " << col << " to " << end;
  }
  TileCodes other = codes;
  CellCode& changed = other[UniformInt(rng, 0, kCellsPerTile - 1)];
  changed = IsUnknown(changed) ? 17.0F : kUnknownCode;
  EXPECT_FALSE(tile->Holds(other));
}

TEST(TileTest, HoldsTheCodesItWasMadeOf) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  // About as many codes as a byte can number, and far fewer and more.
  for (const int num_codes : {1, 2, 5, 255, 256, 257, 10000}) {
    std::vector<CellCode> codes{kUnknownCode};
    while (static_cast<int>(codes.size()) < num_codes) {
      codes.push_back(static_cast<CellCode>(codes.size()) / 4);
    }
    for (const int longest : {1, 40, 3000}) {
      SCOPED_TRACE(num_codes);
      ExpectTileOf(RandomCodes(rng, codes, longest), rng);
    }
  }
}

TEST(TileTest, AllNaNsAreTheSameUnknown) {
  Rng rng(1);
  const CellCode other_nan = std::bit_cast<CellCode>(Bits(kUnknownCode) ^ 1U);
  ExpectTileOf(RandomCodes(rng, {kUnknownCode, other_nan, -other_nan, 0.5F}, 20), rng);
}

// Zeros of both signs are equal, so that a run may hold both; each cell keeps the sign written.
TEST(TileTest, ZerosKeepTheirSign) {
  Rng rng(1);
  ExpectTileOf(RandomCodes(rng, {0.0F, -0.0F, 1.0F}, 20), rng);
  ExpectTileOf(RandomCodes(rng, {-0.0F}, 20), rng);
}

TEST(TileTest, B1TileOfOneCodeTakesNoMemoryForItsCells) {
  Rng rng(1);
  for (const CellCode code : {0.25F, 0.0F, kUnknownCode}) {
    TileCodes codes;
    codes.fill(code);
    ExpectTileOf(codes, rng);
    EXPECT_LT(Tile::Make(codes)->ByteSize(), 256);
    codes[77] = 0.5F;
    EXPECT_GE(Tile::Make(codes)->ByteSize(), kCellsPerTile);
  }
}

}  // namespace
}  // namespace hypermap
