#include "map/objects/box_grid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

// Boxes whose sizes span several powers of ten: some clustered, some equal, some empty.
std::vector<Box> RandomBoxes(Rng& rng, int count, const Point& centre, double range_m) {
  std::vector<Box> boxes;
  Point heap = centre;
  for (int i = 0; i < count; ++i) {
    if (UniformInt(rng, 0, 9) == 0) {
      heap = {centre.x + Uniform(rng, -range_m, range_m),
              centre.y + Uniform(rng, -range_m, range_m)};
    }
    const double spread_m = UniformInt(rng, 0, 1) ? 2.0 : range_m;
    const Point p{heap.x + Uniform(rng, -spread_m, spread_m),
                  heap.y + Uniform(rng, -spread_m, spread_m)};
    const double size_m = std::pow(10, Uniform(rng, -1.3, 2.7));
    boxes.push_back({p, {p.x + size_m * Uniform(rng, 0, 1), p.y + size_m * Uniform(rng, 0, 1)}});
    if (UniformInt(rng, 0, 19) == 0) boxes.back() = boxes[UniformInt(rng, 0, i)];
    if (UniformInt(rng, 0, 49) == 0) boxes.back() = Box();
  }
  return boxes;
}

std::vector<int> AtPoint(const BoxGrid& grid, const Point& p) {
  std::vector<int> items;
  for (const CellLevel& level : grid.levels()) {
    CellLevel::Look look;
    if (!level.Aim(p, &look)) continue;
    level.Open(&look);
    level.Read(look, [&](int item) { items.push_back(item); });
  }
  return items;
}

// Expects that `found` contains all of `expected`, and nothing twice.
void ExpectSuperset(std::vector<int> found, const std::vector<int>& expected) {
  std::sort(found.begin(), found.end());
  EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
  EXPECT_TRUE(std::includes(found.begin(), found.end(), expected.begin(), expected.end()));
}

void ExpectFindsAll(Rng& rng, const std::vector<Box>& boxes, const Point& centre, double range_m) {
  const BoxGrid grid(boxes);
  for (int i = 0; i < 30; ++i) {
    // Test corners of boxes, too, where rounding errors would show.
    const Box& some = boxes[UniformInt(rng, 0, static_cast<int>(boxes.size()) - 1)];
    Point p{centre.x + Uniform(rng, -range_m, range_m), centre.y + Uniform(rng, -range_m, range_m)};
    if (i % 2 && !some.empty()) p = i % 4 == 1 ? some.min : Point{some.max.x, some.min.y};
    std::vector<int> expected;
    for (size_t b = 0; b < boxes.size(); ++b) {
      if (boxes[b].Covers(p)) expected.push_back(static_cast<int>(b));
    }
    ExpectSuperset(AtPoint(grid, p), expected);

    Box query{p, {p.x + Uniform(rng, 0, 5), p.y + Uniform(rng, 0, range_m)}};
    if (i == 0) query = {{-1e300, -1e300}, {1e300, 1e300}};
    expected.clear();
    for (size_t b = 0; b < boxes.size(); ++b) {
      if (boxes[b].Intersects(query) && !boxes[b].empty()) expected.push_back(static_cast<int>(b));
    }
    std::vector<int> found;
    grid.Visit(query, [&](int item) { found.push_back(item); });
    ExpectSuperset(found, expected);
  }
}

TEST(BoxGridTest, FindsEachBoxOnceWhereverAndHoweverLargeItIs) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (const int count : {1, 2, 50, 2000}) {
    for (const double range_m : {0.5, 30.0, 5e4, 9e8}) {
      for (const Point& centre :
           {Point{0, 0}, Point{5e5, -6e6}, Point{-9e8, 9e8}, Point{1e12, 0}}) {
        ExpectFindsAll(rng, RandomBoxes(rng, count, centre, range_m), centre, range_m);
      }
    }
  }
}

TEST(BoxGridTest, HasNothingWhenThereIsNothing) {
  EXPECT_TRUE(BoxGrid().levels().empty());
  EXPECT_TRUE(BoxGrid(std::vector<Box>(3)).levels().empty());
}

TEST(BoxGridTest, LooksAtFewBoxesAlsoInAHeapOfCupsOnALargeSite) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  std::vector<Box> boxes;
  const auto add = [&](const Point& p, double side_m) {
    boxes.push_back({p, {p.x + side_m, p.y + side_m}});
  };
  for (int i = 0; i < 5000; ++i) add({Uniform(rng, 0, 10), Uniform(rng, 0, 10)}, 0.08);
  for (int i = 0; i < 20000; ++i) add({Uniform(rng, 0, 400), Uniform(rng, 0, 400)}, 1.5);
  for (int i = 0; i < 50; ++i) add({Uniform(rng, 0, 1e5), Uniform(rng, 0, 1e5)}, 200);
  const BoxGrid grid(boxes);
  EXPECT_LE(grid.levels().size(), 4u);
  int64_t read = 0;
  for (int i = 0; i < 1000; ++i) {
    read += static_cast<int64_t>(AtPoint(grid, {Uniform(rng, 0, 10), Uniform(rng, 0, 10)}).size());
  }
  EXPECT_LT(read, 3000);
}

}  // namespace
}  // namespace hypermap
