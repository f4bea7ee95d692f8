#include "map/exploration/viewshed.h"

#include <cmath>
#include <set>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"

namespace hypermap {
namespace {

using testing::DrawnFloor;
using testing::RandomFloor;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

std::set<CellIndex> Seen(const FloorPlan& plan, const CellIndex& from, int32_t range) {
  std::set<CellIndex> seen;
  ViewshedRays rays(range);
  rays.ForEachVisible(plan, from, [&seen](const CellIndex& cell) {
    EXPECT_TRUE(seen.insert(cell).second) << "told twice";
  });
  return seen;
}

TEST(ViewshedTest, EndsAtWhatIsNotFree) {
  const FloorPlan plan = DrawnFloor({"..#..",  //
                                     "..#..",  //
                                     ".....",  //
                                     "..?.."});
  const std::set<CellIndex> seen = Seen(plan, {1, 0}, 9);
  EXPECT_TRUE(seen.contains({1, 4}));
  EXPECT_TRUE(seen.contains({3, 1}));
  EXPECT_FALSE(seen.contains({3, 3}));
  EXPECT_FALSE(seen.contains({0, 2}));
  EXPECT_FALSE(seen.contains({3, 2}));
  EXPECT_TRUE(Seen(plan, {3, 2}, 9).empty());
  EXPECT_TRUE(Seen(plan, {7, 7}, 9).empty());
}

TEST(ViewshedTest, DoesNotGoThroughACorner) {
  const FloorPlan plan = DrawnFloor({"#.",  //
                                     ".#"});
  EXPECT_FALSE(HasLineOfSight(plan, {0, 0}, {1, 1}));
  EXPECT_EQ(Seen(plan, {0, 0}, 3), (std::set<CellIndex>{{0, 0}}));
  EXPECT_FALSE(HasLineOfSight(DrawnFloor({"..", ".#"}), {0, 0}, {1, 1}));
  EXPECT_TRUE(HasLineOfSight(DrawnFloor({"..", ".."}), {0, 0}, {1, 1}));
}

TEST(ViewshedTest, ReachesAllOfAFreeDisc) {
  const FloorPlan free(CellBox{-40, 41, -40, 41}, Floor::kFree);
  for (const int32_t range : {1, 2, 3, 7, 20, 33}) {
    const std::set<CellIndex> seen = Seen(free, {0, 0}, range);
    for (size_t i = 0; i < free.values().size(); ++i) {
      const CellIndex cell = free.CellOf(i);
      EXPECT_EQ(seen.contains(cell), cell.row * cell.row + cell.col * cell.col < range * range)
          << cell.row << " " << cell.col << " range " << range;
    }
  }
}

// Returns whether the segment between the centres avoids the closed squares of all cells that are
// not free.
bool HasLineOfSightByHand(const FloorPlan& plan, const CellIndex& a, const CellIndex& b) {
  const double dr = b.row - a.row, dc = b.col - a.col;
  for (size_t i = 0; i < plan.values().size(); ++i) {
    if (plan.values()[i] == Floor::kFree) continue;
    const CellIndex cell = plan.CellOf(i);
    // Clip the segment to the closed square [-1/2, 1/2] around the cell (Liang and Barsky).
    double low = 0, high = 1;
    bool outside = false;
    const auto clip = [&](double at, double step, double centre) {
      for (const double side : {-1.0, 1.0}) {
        const double rate = side * step, room = 0.5 - side * (at - centre);
        if (rate == 0) {
          outside = outside || room < 0;
        } else if (rate > 0) {
          high = std::min(high, room / rate);
        } else {
          low = std::max(low, room / rate);
        }
      }
    };
    clip(a.row, dr, cell.row);
    clip(a.col, dc, cell.col);
    // No line between centres runs along a side of a square.
    if (!outside && low <= high + 1e-12) return false;
  }
  return true;
}

TEST(ViewshedTest, LinesEqualBruteForceAndAreSymmetric) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int round = 0; round < 300; ++round) {
    const FloorPlan plan = RandomFloor(rng, 16, Uniform(rng, 0, 0.15));
    const CellIndex a = plan.CellOf(UniformInt(rng, 0, plan.values().size() - 1));
    const CellIndex b = plan.CellOf(UniformInt(rng, 0, plan.values().size() - 1));
    ASSERT_EQ(HasLineOfSight(plan, a, b), HasLineOfSightByHand(plan, a, b))
        << a.row << " " << a.col << " to " << b.row << " " << b.col;
    EXPECT_EQ(HasLineOfSight(plan, a, b), HasLineOfSight(plan, b, a));
  }
}

TEST(ViewshedTest, SeesWhatSomeRayMeets) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  constexpr int32_t kRange = 9;
  ViewshedRays rays(kRange);
  for (int round = 0; round < 60; ++round) {
    const FloorPlan plan = RandomFloor(rng, 24, 0.08);
    const CellIndex from = plan.CellOf(UniformInt(rng, 0, plan.values().size() - 1));
    std::set<CellIndex> seen;
    rays.ForEachVisible(plan, from, [&seen](const CellIndex& cell) { seen.insert(cell); });
    // Every cell on a free line of full length is seen, and cells that are seen are free and in
    // range.
    for (const CellIndex& cell : seen) {
      EXPECT_EQ(plan.at(cell), Floor::kFree);
      EXPECT_LT(std::hypot(cell.row - from.row, cell.col - from.col), kRange);
    }
    for (size_t i = 0; i < plan.values().size(); ++i) {
      const CellIndex to = plan.CellOf(i);
      if (std::max(std::abs(to.row - from.row), std::abs(to.col - from.col)) != kRange) continue;
      if (!HasLineOfSight(plan, from, to)) continue;
      for (double t = 0; t <= 1; t += 0.01) {
        const CellIndex between{
            static_cast<int32_t>(std::lround(from.row + t * (to.row - from.row))),
            static_cast<int32_t>(std::lround(from.col + t * (to.col - from.col)))};
        if (std::hypot(between.row - from.row, between.col - from.col) >= kRange) continue;
        EXPECT_TRUE(seen.contains(between));
      }
    }
  }
}

}  // namespace
}  // namespace hypermap
