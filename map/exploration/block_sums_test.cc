#include "map/exploration/block_sums.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace hypermap {
namespace {

TEST(BlockSumsTest, BoundsAreAtLeastTheNumberAndAtMostThatOfTheTouchedBlocks) {
  std::mt19937 random(1);
  const CellBox box{-13, 30, 5, 71};
  std::set<CellIndex> marked;
  for (int i = 0; i < 300; ++i) {
    marked.insert({box.row_begin + static_cast<int32_t>(random() % 43),
                   box.col_begin + static_cast<int32_t>(random() % 66)});
  }
  const BlockSums sums(box, [&](const CellIndex& cell) { return marked.contains(cell); });
  const auto number = [&](const CellBox& part) {
    int64_t n = 0;
    for (const CellIndex& cell : marked) n += part.Contains(cell);
    return n;
  };
  EXPECT_EQ(sums.AtMost(box), static_cast<int64_t>(marked.size()));
  for (int i = 0; i < 1000; ++i) {
    const auto row = box.row_begin - 10 + static_cast<int32_t>(random() % 60);
    const auto col = box.col_begin - 10 + static_cast<int32_t>(random() % 90);
    const CellBox part{row, row + static_cast<int32_t>(random() % 30), col,
                       col + static_cast<int32_t>(random() % 30)};
    const int32_t side = BlockSums::kSide;
    const CellBox wider{part.row_begin - side, part.row_end + side, part.col_begin - side,
                        part.col_end + side};
    EXPECT_GE(sums.AtMost(part), number(part.empty() ? CellBox() : part));
    EXPECT_LE(sums.AtMost(part), number(wider));
  }
  EXPECT_EQ(sums.AtMost({100, 200, 5, 71}), 0);
}

}  // namespace
}  // namespace hypermap
