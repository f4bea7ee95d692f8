#include "ingest/perception/components.h"

#include <cstdint>
#include <queue>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::ingest {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::UniformInt;
using ::testing::ElementsAre;

bool Always(int /*i*/) { return true; }

TEST(ComponentsTest, PixelsThatTouchAreOne) {
  const std::vector<int> image = {1, 1, 0, 1,  //
                                  0, 1, 0, 1,  //
                                  1, 0, 0, 1};
  const Components found = ConnectedComponents(
      4, 3, [&](int i) { return image[i] != 0; }, Always, Always);
  EXPECT_EQ(found.count, 3);
  EXPECT_THAT(found.of, ElementsAre(0, 0, -1, 1, -1, 0, -1, 1, 2, -1, -1, 1));
}

// Two arms that meet only in the last row are one component, numbered by the first arm.
TEST(ComponentsTest, ArmsThatMeetBelowAreOne) {
  const std::vector<int> image = {1, 0, 1, 0, 1,  //
                                  1, 0, 1, 0, 1,  //
                                  1, 1, 1, 0, 1};
  const Components found = ConnectedComponents(
      5, 3, [&](int i) { return image[i] != 0; }, Always, Always);
  EXPECT_EQ(found.count, 2);
  EXPECT_THAT(found.of, ElementsAre(0, -1, 0, -1, 1, 0, -1, 0, -1, 1, 0, 0, 0, -1, 1));
}

TEST(ComponentsTest, PixelsThatAreNotJoinedArePartedThoughTheyTouch) {
  const Components found = ConnectedComponents(
      3, 1, Always, [](int i) { return i == 0; }, Always);
  EXPECT_THAT(found.of, ElementsAre(0, 0, 1));
}

TEST(ComponentsTest, AnImageWithoutMembersHasNone) {
  const auto never = [](int /*i*/) { return false; };
  EXPECT_EQ(ConnectedComponents(3, 2, never, Always, Always).count, 0);
  EXPECT_EQ(ConnectedComponents(0, 0, Always, Always, Always).count, 0);
}

// The oracle grows each component from its first pixel.
TEST(ComponentsTest, RandomImagesEqualFloodFill) {
  Rng rng(TestSeed());
  for (int round = 0; round < 200; ++round) {
    const int w = UniformInt(rng, 1, 24);
    const int h = UniformInt(rng, 1, 24);
    std::vector<uint8_t> member(static_cast<size_t>(w) * h);
    std::vector<uint8_t> right(member.size());
    std::vector<uint8_t> down(member.size());
    for (size_t i = 0; i < member.size(); ++i) {
      member[i] = UniformInt(rng, 0, 9) < 7;
      right[i] = UniformInt(rng, 0, 9) < 8;
      down[i] = UniformInt(rng, 0, 9) < 8;
    }
    const Components found = ConnectedComponents(
        w, h, [&](int i) { return member[i] != 0; }, [&](int i) { return right[i] != 0; },
        [&](int i) { return down[i] != 0; });

    std::vector<int> expected(member.size(), -1);
    int count = 0;
    for (int start = 0; start < w * h; ++start) {
      if (!member[start] || expected[start] != -1) continue;
      std::queue<int> queue({start});
      expected[start] = count;
      const auto visit = [&](int i) {
        if (!member[i] || expected[i] != -1) return;
        expected[i] = count;
        queue.push(i);
      };
      for (; !queue.empty(); queue.pop()) {
        const int i = queue.front();
        if (i % w + 1 < w && right[i]) visit(i + 1);
        if (i + w < w * h && down[i]) visit(i + w);
        if (i % w > 0 && right[i - 1]) visit(i - 1);
        if (i >= w && down[i - w]) visit(i - w);
      }
      ++count;
    }
    ASSERT_EQ(found.count, count);
    ASSERT_EQ(found.of, expected);
  }
}

}  // namespace
}  // namespace hypermap::ingest
