#include "map/layers/packed_rtree.h"

#include <algorithm>

#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::Uniform;

std::vector<Box> RandomBoxes(Rng& rng, int count) {
  std::vector<Box> boxes;
  for (int i = 0; i < count; ++i) {
    const Point p{Uniform(rng, -50, 50), Uniform(rng, -50, 50)};
    boxes.push_back({p, {p.x + Uniform(rng, 0, 3), p.y + Uniform(rng, 0, 3)}});
  }
  return boxes;
}

TEST(PackedRTreeTest, VisitsExactlyTheBoxesThatIntersect) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (const int count : {0, 1, 2, 15, 16, 17, 256, 257, 3000}) {
    const std::vector<Box> boxes = RandomBoxes(rng, count);
    const PackedRTree tree(boxes);
    for (const Box& query : RandomBoxes(rng, 20)) {
      std::vector<int> expected, visited;
      for (int i = 0; i < count; ++i) {
        if (boxes[i].Intersects(query)) expected.push_back(i);
      }
      tree.Visit(query, [&](int item) { visited.push_back(item); });
      std::sort(visited.begin(), visited.end());
      EXPECT_EQ(visited, expected);
    }
  }
}

TEST(PackedRTreeTest, VisitsNearestInOrderUntilToldToStop) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const std::vector<Box> boxes = RandomBoxes(rng, 1000);
  const PackedRTree tree(boxes);
  const Point p{Uniform(rng, -60, 60), Uniform(rng, -60, 60)};
  std::vector<double> expected, visited;
  for (const Box& box : boxes) expected.push_back(Distance(box, p));
  std::sort(expected.begin(), expected.end());
  expected.resize(100);
  tree.VisitNearest(p, [&](int item, double distance_m) {
    EXPECT_EQ(distance_m, Distance(boxes[item], p));
    visited.push_back(distance_m);
    return visited.size() < 100;
  });
  EXPECT_EQ(visited, expected);
}

}  // namespace
}  // namespace hypermap
