#include "client_libs/ros2/conversion/regions.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace hypermap::ros2 {
namespace {

// Sets of pixels that grow together. The root of a set is its first pixel.
class PixelSets {
 public:
  explicit PixelSets(size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int Root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(int i, int j) {
    const auto [first, second] = std::minmax({Root(i), Root(j)});
    parent_[second] = first;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace

Regions RegionsOf(const std::vector<int32_t>& numbers, int width) {
  const int size = static_cast<int>(numbers.size());
  PixelSets sets(numbers.size());
  for (int i = 0; i < size; ++i) {
    const int column = i % width;
    const auto join = [&](int j) {
      if (j >= 0 && numbers[j] == numbers[i]) sets.Join(i, j);
    };
    join(i - width);
    if (column > 0) {
      join(i - 1);
      join(i - width - 1);
    }
    if (column + 1 < width) join(i - width + 1);
  }
  Regions regions;
  regions.of.resize(numbers.size());
  for (int i = 0; i < size; ++i) {
    const int root = sets.Root(i);
    regions.of[i] = root == i ? regions.count++ : regions.of[root];
  }
  return regions;
}

}  // namespace hypermap::ros2
