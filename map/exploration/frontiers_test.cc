#include "map/exploration/frontiers.h"

#include <algorithm>
#include <set>

#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

// '.' is unexplored, 'o' is explored, everything else is kNone. The first line is the top row.
CoverageRaster DrawnCoverage(const std::vector<std::string>& lines) {
  const auto rows = static_cast<int32_t>(lines.size());
  CoverageRaster coverage(CellBox{0, rows, 0, static_cast<int32_t>(lines.front().size())},
                          Coverage::kNone);
  for (size_t i = 0; i < coverage.values().size(); ++i) {
    const CellIndex cell = coverage.CellOf(i);
    const char c = lines[rows - 1 - cell.row][cell.col];
    coverage.set(cell, c == '.' ? Coverage::kUnexplored
                                : (c == 'o' ? Coverage::kExplored : Coverage::kNone));
  }
  return coverage;
}

// Applies the definition, cell by cell and pair by pair.
std::vector<Frontier> FrontiersByHand(const CoverageRaster& coverage) {
  std::vector<CellIndex> cells;
  for (size_t i = 0; i < coverage.values().size(); ++i) {
    const CellIndex c = coverage.CellOf(i);
    const bool beside = coverage.at({c.row - 1, c.col}) == Coverage::kExplored ||
                        coverage.at({c.row + 1, c.col}) == Coverage::kExplored ||
                        coverage.at({c.row, c.col - 1}) == Coverage::kExplored ||
                        coverage.at({c.row, c.col + 1}) == Coverage::kExplored;
    if (coverage.at(c) == Coverage::kUnexplored && beside) cells.push_back(c);
  }
  std::vector<Frontier> frontiers;
  for (const CellIndex& cell : cells) {
    Frontier joined{cell};
    std::vector<Frontier> apart;
    for (Frontier& other : frontiers) {
      const bool touches = std::any_of(other.begin(), other.end(), [&](const CellIndex& c) {
        return std::abs(c.row - cell.row) <= 1 && std::abs(c.col - cell.col) <= 1;
      });
      if (touches) {
        joined.insert(joined.end(), other.begin(), other.end());
      } else {
        apart.push_back(std::move(other));
      }
    }
    apart.push_back(std::move(joined));
    frontiers = std::move(apart);
  }
  for (Frontier& frontier : frontiers) std::sort(frontier.begin(), frontier.end());
  std::sort(frontiers.begin(), frontiers.end());
  return frontiers;
}

TEST(FrontiersTest, AreUnexploredCellsBesideExploredOnes) {
  const CoverageRaster coverage = DrawnCoverage({"oo..",  //
                                                 "oo #",  //
                                                 "....",  //
                                                 "...."});
  EXPECT_THAT(Frontiers(coverage).All(), ElementsAre(Frontier{{1, 0}, {1, 1}}, Frontier{{3, 2}}));
}

TEST(FrontiersTest, ThereAreNoneWhereNothingIsExplored) {
  EXPECT_THAT(Frontiers(DrawnCoverage({"...", "..."})).All(), IsEmpty());
  EXPECT_THAT(Frontiers(DrawnCoverage({"ooo", "ooo"})).All(), IsEmpty());
  EXPECT_THAT(Frontiers(CoverageRaster(CellBox{})).All(), IsEmpty());
}

TEST(FrontiersTest, EqualBruteForceThroughChanges) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int round = 0; round < 40; ++round) {
    const int32_t side = UniformInt(rng, 1, 30);
    CoverageRaster coverage(CellBox{-3, side - 3, 5, side + 5}, Coverage::kNone);
    for (Coverage& cell : coverage.mutable_values()) {
      cell = static_cast<Coverage>(UniformInt(rng, 0, 2));
    }
    Frontiers frontiers(coverage);
    ASSERT_EQ(frontiers.All(), FrontiersByHand(coverage));
    for (int step = 0; step < 12; ++step) {
      // Sets a block of cells, as a view of a camera does.
      const CellIndex at = coverage.CellOf(UniformInt(rng, 0, coverage.values().size() - 1));
      const auto now = static_cast<Coverage>(UniformInt(rng, 0, 2));
      std::vector<CellIndex> changed;
      for (int32_t row = at.row; row < at.row + 4; ++row) {
        for (int32_t col = at.col; col < at.col + 3; ++col) {
          if (!coverage.Contains({row, col}) || UniformInt(rng, 0, 9) == 0) continue;
          coverage.set({row, col}, now);
          changed.push_back({row, col});
        }
      }
      frontiers.Update(coverage, changed);
      ASSERT_EQ(frontiers.All(), FrontiersByHand(coverage));
    }
  }
}

TEST(FrontiersTest, WorkFollowsTheChange) {
  CoverageRaster coverage(CellBox{0, 1000, 0, 1000}, Coverage::kNone);
  for (Coverage& cell : coverage.mutable_values()) cell = Coverage::kUnexplored;
  Frontiers frontiers(coverage);
  std::vector<CellIndex> changed;
  for (int32_t row = 500; row < 520; ++row) {
    for (int32_t col = 500; col < 520; ++col) {
      coverage.set({row, col}, Coverage::kExplored);
      changed.push_back({row, col});
    }
  }
  frontiers.Update(coverage, changed);
  EXPECT_THAT(frontiers.All(), ElementsAre(::testing::SizeIs(80)));
  EXPECT_LT(frontiers.last_work(), 5 * 400);
}

TEST(FrontiersTest, ManySmallOnesAreLookedAtAsOftenAsALargeOne) {
  constexpr int32_t kSide = 512;
  constexpr int64_t kCellsPerLook = 4096;
  CoverageRaster coverage(CellBox{0, kSide, 0, kSide}, Coverage::kExplored);
  for (int32_t row = 0; row < kSide; ++row) {
    for (int32_t col = 0; col < kSide; col += 2) coverage.set({row, col}, Coverage::kUnexplored);
  }
  CancelledAfter cancelled(/*num_looks=*/1'000'000);
  const Frontiers frontiers(coverage);
  // Each cell is visited once, and each cell of a frontier twice more.
  EXPECT_GE(cancelled.num_looks(), 2 * kSide * kSide / kCellsPerLook);
  EXPECT_EQ(frontiers.All().size(), kSide / 2);
}

}  // namespace
}  // namespace hypermap
