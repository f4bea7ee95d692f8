#include "map/objects/packed_rtree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::Uniform;

std::vector<Box> RandomBoxes(Rng& rng, int count, const Point& centre = {}) {
  std::vector<Box> boxes;
  for (int i = 0; i < count; ++i) {
    const Point p{centre.x + Uniform(rng, -50, 50), centre.y + Uniform(rng, -50, 50)};
    boxes.push_back({p, {p.x + Uniform(rng, 0, 3), p.y + Uniform(rng, 0, 3)}});
  }
  return boxes;
}

PackedRTree MakeTree(const std::vector<Box>& boxes) {
  const std::vector<uint32_t> keys = HilbertKeys(boxes);
  std::vector<int32_t> items(boxes.size());
  std::iota(items.begin(), items.end(), 0);
  std::sort(items.begin(), items.end(), [&](int32_t a, int32_t b) { return keys[a] < keys[b]; });
  return PackedRTree(boxes, items);
}

TEST(PackedRTreeTest, VisitsTheBoxesThatIntersectAndNoneFarFromIt) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (const int count : {0, 1, 2, 15, 16, 17, 256, 257, 3000}) {
    for (const Point& centre : {Point{0, 0}, Point{5e5, -6e6}, Point{-9e8, 9e8}}) {
      const std::vector<Box> boxes = RandomBoxes(rng, count, centre);
      const PackedRTree tree = MakeTree(boxes);
      for (const Box& query : RandomBoxes(rng, 20, centre)) {
        std::vector<int> expected, visited;
        for (int i = 0; i < count; ++i) {
          if (boxes[i].Intersects(query)) expected.push_back(i);
        }
        const Box wider{{query.min.x - 1e-4, query.min.y - 1e-4},
                        {query.max.x + 1e-4, query.max.y + 1e-4}};
        tree.Visit(query, [&](int item) {
          EXPECT_TRUE(boxes[item].Intersects(wider));
          if (boxes[item].Intersects(query)) visited.push_back(item);
        });
        std::sort(visited.begin(), visited.end());
        EXPECT_EQ(visited, expected);
      }
    }
  }
}

TEST(PackedRTreeTest, VisitsNearestInOrder) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const std::vector<Box> boxes = RandomBoxes(rng, 1000);
  const PackedRTree tree = MakeTree(boxes);
  for (const double far : {1.0, 1e6, 1e300}) {
    const Point p{far * Uniform(rng, -60, 60), far * Uniform(rng, -60, 60)};
    double before_m = 0;
    int visited = 0;
    tree.VisitNearest(p, [&](int item, double at_least_m) {
      EXPECT_LE(at_least_m, Distance(boxes[item], p));
      if (far < 1e9) {
        EXPECT_GE(at_least_m, Distance(boxes[item], p) - 1e-4);
      }
      EXPECT_GE(at_least_m, before_m);
      before_m = at_least_m;
      ++visited;
      return std::numeric_limits<double>::infinity();
    });
    EXPECT_EQ(visited, 1000);
  }
}

TEST(PackedRTreeTest, VisitsNothingFartherThanWanted) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const std::vector<Box> boxes = RandomBoxes(rng, 1000);
  const PackedRTree tree = MakeTree(boxes);
  const Point p{Uniform(rng, -50, 50), Uniform(rng, -50, 50)};
  std::vector<int> expected, visited;
  for (int i = 0; i < 1000; ++i) {
    if (Distance(boxes[i], p) <= 20) expected.push_back(i);
  }
  tree.VisitNearest(p, [&](int item, double) {
    if (Distance(boxes[item], p) <= 20) visited.push_back(item);
    return 20.0;
  });
  std::sort(visited.begin(), visited.end());
  EXPECT_EQ(visited, expected);
}

TEST(PackedRTreeTest, ABoxThatIsEmptyMeetsNothing) {
  const PackedRTree tree = MakeTree({Box(), Box()});
  int visited = 0;
  tree.Visit({{-1, -1}, {1, 1}}, [&](int) { ++visited; });
  EXPECT_EQ(visited, 0);
  tree.VisitAll([&](int) { ++visited; });
  EXPECT_EQ(visited, 2);
}

}  // namespace
}  // namespace hypermap
