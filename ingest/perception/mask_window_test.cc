#include "ingest/perception/mask_window.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "tests/support/random_map.h"

namespace hypermap::ingest {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;
using testing::Mask;
using testing::Rectangle;

constexpr int kAll = 1 << 30;

TEST(MaskWindowTest, WindowIsTheMasksBoxAndTheMargin) {
  const MaskWindow window = CutOut(Rectangle(20, 10, 5, 4, 8, 6), 20, 10, 2, kAll);
  EXPECT_EQ(window.stride, 1);
  EXPECT_EQ(window.u0, 3);
  EXPECT_EQ(window.v0, 2);
  EXPECT_EQ(window.width, 7);
  EXPECT_EQ(window.height, 6);
  EXPECT_EQ(window.num_inside, 6);
  EXPECT_EQ(window.inside, Rectangle(7, 6, 2, 2, 5, 4));
  EXPECT_EQ(window.image_index(2, 2, 20), 4 * 20 + 5);
}

TEST(MaskWindowTest, MarginEndsAtTheImagesBorder) {
  const MaskWindow first = CutOut(Rectangle(10, 8, 0, 0, 2, 2), 10, 8, 3, kAll);
  EXPECT_EQ(first.u0, 0);
  EXPECT_EQ(first.v0, 0);
  EXPECT_EQ(first.width, 5);
  EXPECT_EQ(first.height, 5);
  const MaskWindow last = CutOut(Rectangle(10, 8, 8, 6, 10, 8), 10, 8, 3, kAll);
  EXPECT_EQ(last.u0, 5);
  EXPECT_EQ(last.v0, 3);
  EXPECT_EQ(last.width, 5);
  EXPECT_EQ(last.height, 5);
}

TEST(MaskWindowTest, MaskWithoutPixelsHasNoWindow) {
  EXPECT_TRUE(CutOut(Mask(80, 0), 10, 8, 3, kAll).empty());
}

// 400 of 1600 pixels are allowed, so that every second row and column from 6 on is taken; 10, 12,
// ..., 48 lie in the mask.
TEST(MaskWindowTest, LargeMasksAreThinned) {
  const MaskWindow window = CutOut(Rectangle(60, 60, 10, 10, 50, 50), 60, 60, 4, 400);
  EXPECT_EQ(window.stride, 2);
  EXPECT_EQ(window.u0, 6);
  EXPECT_EQ(window.width, 24);
  EXPECT_EQ(window.height, 24);
  EXPECT_EQ(window.num_inside, 400);
  EXPECT_EQ(CutOut(Rectangle(60, 60, 10, 10, 50, 50), 60, 60, 4, 399).stride, 3);
}

Mask RandomMask(Rng& rng, int width, int height) {
  Mask mask(static_cast<size_t>(width) * height, 0);
  const double density = Uniform(rng, 0.01, 0.99);
  for (uint8_t& pixel : mask) pixel = Uniform(rng, 0, 1) < density;
  return mask;
}

TEST(MaskWindowTest, WindowShowsTheMaskOfTheImage) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  Rng rng(seed);
  for (int round = 0; round < 100; ++round) {
    const int width = UniformInt(rng, 1, 40);
    const int height = UniformInt(rng, 1, 30);
    const Mask mask = RandomMask(rng, width, height);
    const MaskWindow window =
        CutOut(mask, width, height, UniformInt(rng, 0, 5), UniformInt(rng, 1, 500));
    int inside = 0;
    for (int v = 0; v < window.height; ++v) {
      for (int u = 0; u < window.width; ++u) {
        ASSERT_LT(window.u0 + u * window.stride, width);
        ASSERT_LT(window.v0 + v * window.stride, height);
        ASSERT_EQ(window.inside[window.index(u, v)], mask[window.image_index(u, v, width)]);
        inside += window.inside[window.index(u, v)];
      }
    }
    ASSERT_EQ(window.num_inside, inside);
    if (window.stride == 1) {
      ASSERT_EQ(inside, std::count(mask.begin(), mask.end(), 1));
    }
  }
}

int BruteForceDepth(const MaskWindow& window, int u, int v) {
  int nearest = 255;
  for (int row = 0; row < window.height; ++row) {
    for (int col = 0; col < window.width; ++col) {
      if (window.inside[window.index(col, row)] == window.inside[window.index(u, v)]) continue;
      nearest = std::min(nearest, std::max(std::abs(row - v), std::abs(col - u)));
    }
  }
  return nearest;
}

TEST(MaskWindowTest, DepthIsTheDistanceToTheOtherKind) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  Rng rng(seed);
  for (int round = 0; round < 40; ++round) {
    const int width = UniformInt(rng, 1, 24);
    const int height = UniformInt(rng, 1, 18);
    Mask mask = RandomMask(rng, width, height);
    if (round % 2 == 0) mask = testing::Grown(mask, width, 2);
    MaskWindow window = CutOut(mask, width, height, 3, kAll);
    MeasureDepth(&window);
    ASSERT_EQ(window.depth.size(), window.inside.size());
    for (int v = 0; v < window.height; ++v) {
      for (int u = 0; u < window.width; ++u) {
        ASSERT_EQ(window.depth[window.index(u, v)], BruteForceDepth(window, u, v))
            << u << ", " << v;
      }
    }
  }
}

TEST(MaskWindowTest, DepthEndsAt255) {
  MaskWindow window = CutOut(Rectangle(600, 1, 300, 0, 600, 1), 600, 1, 300, kAll);
  MeasureDepth(&window);
  EXPECT_EQ(window.depth[0], 255);
  EXPECT_EQ(window.depth[50], 250);
  EXPECT_EQ(window.depth[299], 1);
  EXPECT_EQ(window.depth[300], 1);
  EXPECT_EQ(window.depth[599], 255);
}

}  // namespace
}  // namespace hypermap::ingest
