#include "map/exploration/path.h"

#include <algorithm>
#include <map>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/exploration/testing/drawn_floor.h"

namespace hypermap {
namespace {

using testing::DrawnFloor;
using testing::RandomFloor;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

std::map<CellIndex, int32_t> Lengths(PathSearch& search, const FloorPlan& plan,
                                     const CellIndex& start) {
  std::map<CellIndex, int32_t> lengths;
  int32_t last = 0;
  search.Run(
      start, [&](const CellIndex& cell) { return plan.at(cell) == Floor::kFree; },
      [&](const CellIndex& cell, int32_t length) {
        EXPECT_GE(length, last) << "not by length";
        last = length;
        EXPECT_TRUE(lengths.emplace(cell, length).second) << "visited twice";
        return true;
      });
  return lengths;
}

// Bellman-Ford: relaxes all moves until nothing changes.
std::map<CellIndex, int32_t> LengthsByHand(const FloorPlan& plan, const CellIndex& start) {
  const auto is_free = [&](int32_t row, int32_t col) {
    return plan.at({row, col}) == Floor::kFree;
  };
  std::map<CellIndex, int32_t> lengths{{start, 0}};
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [cell, length] : std::map<CellIndex, int32_t>(lengths)) {
      for (int32_t r = -1; r <= 1; ++r) {
        for (int32_t c = -1; c <= 1; ++c) {
          const CellIndex next{cell.row + r, cell.col + c};
          if ((r == 0 && c == 0) || !is_free(next.row, next.col)) continue;
          if (r != 0 && c != 0 &&
              !(is_free(cell.row + r, cell.col) && is_free(cell.row, cell.col + c))) {
            continue;
          }
          const int32_t longer = length + (r != 0 && c != 0 ? 14 : 10);
          const auto [it, is_new] = lengths.try_emplace(next, longer);
          if (is_new || longer < it->second) changed = true;
          it->second = std::min(it->second, longer);
        }
      }
    }
  }
  return lengths;
}

TEST(PathSearchTest, EqualsBruteForce) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const FloorPlan first = RandomFloor(rng, 14, 0.3);
  PathSearch search(first.box());
  for (int round = 0; round < 30; ++round) {
    const FloorPlan plan = RandomFloor(rng, 14, 0.3);
    const CellIndex start = plan.CellOf(UniformInt(rng, 0, plan.values().size() - 1));
    const std::map<CellIndex, int32_t> lengths = Lengths(search, plan, start);
    ASSERT_EQ(lengths, LengthsByHand(plan, start));
    for (const auto& [cell, length] : lengths) {
      const std::vector<CellIndex> path = search.PathTo(cell);
      EXPECT_EQ(path.front(), start);
      EXPECT_EQ(path.back(), cell);
      int32_t walked = 0;
      for (size_t i = 1; i < path.size(); ++i) {
        const int32_t r = std::abs(path[i].row - path[i - 1].row);
        const int32_t c = std::abs(path[i].col - path[i - 1].col);
        ASSERT_EQ(std::max(r, c), 1);
        ASSERT_EQ(plan.at(path[i]), Floor::kFree);
        walked += r + c == 2 ? 14 : 10;
      }
      EXPECT_EQ(walked, length);
    }
  }
}

TEST(PathSearchTest, EndsWhereItIsToldTo) {
  const FloorPlan plan = DrawnFloor({"....."});
  PathSearch search(plan.box());
  int visited = 0;
  search.Run(
      {0, 0}, [](const CellIndex&) { return true; },
      [&](const CellIndex&, int32_t) { return ++visited < 3; });
  EXPECT_EQ(visited, 3);
  EXPECT_EQ(Lengths(search, plan, {0, 4}).size(), 5u);
}

}  // namespace
}  // namespace hypermap
