#include "client_libs/ros2/conversion/regions.h"

#include <gtest/gtest.h>

#include <random>

namespace hypermap::ros2 {
namespace {

// The regions by flood fill.
Regions Flood(const std::vector<int32_t>& numbers, int width) {
  const int height = static_cast<int>(numbers.size()) / width;
  Regions regions{0, std::vector<int>(numbers.size(), -1)};
  for (size_t first = 0; first < numbers.size(); ++first) {
    if (regions.of[first] >= 0) continue;
    std::vector<int> todo = {static_cast<int>(first)};
    regions.of[first] = regions.count;
    while (!todo.empty()) {
      const int i = todo.back();
      todo.pop_back();
      for (int v = std::max(0, i / width - 1); v <= std::min(height - 1, i / width + 1); ++v) {
        for (int u = std::max(0, i % width - 1); u <= std::min(width - 1, i % width + 1); ++u) {
          const int j = v * width + u;
          if (regions.of[j] >= 0 || numbers[j] != numbers[i]) continue;
          regions.of[j] = regions.count;
          todo.push_back(j);
        }
      }
    }
    ++regions.count;
  }
  return regions;
}

TEST(RegionsTest, PixelsThatTouchAtACornerAreConnected) {
  EXPECT_EQ(RegionsOf({1, 0, 1,  //
                       0, 1, 0,  //
                       2, 2, 0},
                      3)
                .of,
            (std::vector<int>{0, 1, 0,  //
                              1, 0, 1,  //
                              2, 2, 1}));
}

TEST(RegionsTest, TheLeftAndRightEdgesDoNotTouch) {
  EXPECT_EQ(RegionsOf({0, 1, 1, 0}, 2).count, 2);
  EXPECT_EQ(RegionsOf({5, 0, 5,  //
                       5, 0, 5},
                      3)
                .count,
            3);
}

TEST(RegionsTest, RegionsAreThoseOfAFloodFill) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    const int width = 1 + static_cast<int>(random() % 20);
    std::vector<int32_t> numbers(width * (1 + random() % 20));
    for (int32_t& number : numbers) number = static_cast<int32_t>(random() % 3);
    const Regions found = RegionsOf(numbers, width);
    const Regions expected = Flood(numbers, width);
    EXPECT_EQ(found.count, expected.count);
    EXPECT_EQ(found.of, expected.of);
  }
}

}  // namespace
}  // namespace hypermap::ros2
