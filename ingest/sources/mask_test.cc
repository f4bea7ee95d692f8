#include "ingest/sources/mask.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace hypermap::ingest {
namespace {

using testing::ElementsAre;
using Mask = std::vector<uint8_t>;

// Packs run lengths in the way of pycocotools.
std::string Pack(const std::vector<uint32_t>& counts) {
  std::string packed;
  for (size_t i = 0; i < counts.size(); ++i) {
    int64_t x = counts[i];
    if (i > 2) x -= counts[i - 2];
    bool more = true;
    while (more) {
      int c = static_cast<int>(x & 0x1f);
      x >>= 5;
      more = (c & 0x10) != 0 ? x != -1 : x != 0;
      if (more) c |= 0x20;
      packed += static_cast<char>(c + '0');
    }
  }
  return packed;
}

std::vector<uint32_t> Runs(const Mask& mask, int width, int height) {
  std::vector<uint32_t> counts{0};
  uint8_t value = 0;
  for (int u = 0; u < width; ++u) {
    for (int v = 0; v < height; ++v) {
      if (mask[v * width + u] != value) {
        counts.push_back(0);
        value = 1 - value;
      }
      ++counts.back();
    }
  }
  return counts;
}

// A mask of 4 x 3 pixels:  . # # .
//                          . # . .
//                          # . . .
const Mask kDrawn = {0, 1, 1, 0,  //
                     0, 1, 0, 0,  //
                     1, 0, 0, 0};

TEST(MaskTest, RunsAreReadColumnByColumn) {
  const auto mask = DecodeMask(MaskRuns{4, 3, {2, 3, 1, 1, 5}}, 4, 3);
  ASSERT_TRUE(mask.ok()) << mask.status();
  EXPECT_EQ(*mask, kDrawn);
}

TEST(MaskTest, APackedMaskThatWasEncodedByHand) {
  // The lengths 2, 3 and 1 are written as they are. 1 - 3 = -2 is 11110 with the sign bit set, so
  // '0' + 30 = 'N'; 5 - 1 = 4.
  EXPECT_THAT(*UnpackCounts("231N4"), ElementsAre(2, 3, 1, 1, 5));
  const auto mask = DecodeMask(PackedMaskRuns{4, 3, "231N4"}, 4, 3);
  ASSERT_TRUE(mask.ok()) << mask.status();
  EXPECT_EQ(*mask, kDrawn);
}

TEST(MaskTest, LengthsOfSeveralGroups) {
  // 52 = 1 x 32 + 20 has the groups 20 (another follows) and 1. 16 needs a second group, because
  // its bit 4 would be the sign.
  EXPECT_THAT(*UnpackCounts("d1"), ElementsAre(52));
  EXPECT_THAT(*UnpackCounts("`0"), ElementsAre(16));
}

TEST(MaskTest, RandomMasksComeBack) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 200; ++round) {
    const int width = std::uniform_int_distribution(1, 70)(random);
    const int height = std::uniform_int_distribution(1, 70)(random);
    std::bernoulli_distribution flip(std::uniform_real_distribution(0.0, 1.0)(random));
    Mask mask(static_cast<size_t>(width) * height);
    uint8_t value = 0;
    for (uint8_t& pixel : mask) pixel = value = flip(random) ? 1 - value : value;
    const std::vector<uint32_t> runs = Runs(mask, width, height);
    const auto unpacked = UnpackCounts(Pack(runs));
    ASSERT_TRUE(unpacked.ok()) << unpacked.status();
    EXPECT_EQ(*unpacked, runs);
    EXPECT_EQ(*DecodeMask(PackedMaskRuns{width, height, Pack(runs)}, width, height), mask);
    EXPECT_EQ(*DecodeMask(MaskRuns{width, height, runs}, width, height), mask);
    EXPECT_EQ(*DecodePackedRuns(Pack(runs), width, height), mask);
    EXPECT_EQ(*DecodeRuns(std::vector<int32_t>(runs.begin(), runs.end()), width, height), mask);
  }
}

TEST(MaskTest, BrokenRunsAreRefused) {
  EXPECT_FALSE(DecodeMask(MaskRuns{4, 3, {2, 3}}, 4, 3).ok()) << "too few pixels";
  EXPECT_FALSE(DecodeMask(MaskRuns{4, 3, {2, 3, 8}}, 4, 3).ok()) << "too many";
  EXPECT_FALSE(DecodeMask(MaskRuns{4, 3, {UINT32_MAX, UINT32_MAX}}, 4, 3).ok());
  EXPECT_FALSE(DecodeMask(MaskRuns{3, 4, {12}}, 4, 3).ok()) << "of another image";
  EXPECT_FALSE(DecodeRuns({2, 3}, 4, 3).ok()) << "too few pixels";
  EXPECT_FALSE(DecodeRuns({2, 3, 8}, 4, 3).ok()) << "too many";
  EXPECT_FALSE(DecodeRuns({2, -1, 11}, 4, 3).ok()) << "a negative length";
  EXPECT_FALSE(DecodePackedRuns("23", 4, 3).ok()) << "too few pixels";
  EXPECT_FALSE(UnpackCounts("P").ok()) << "goes on after the end";
  EXPECT_FALSE(UnpackCounts("N").ok()) << "a negative length";
  EXPECT_FALSE(UnpackCounts("2 3").ok()) << "a blank";
  EXPECT_FALSE(UnpackCounts("ooooooooo").ok()) << "more bits than a length has";
}

TEST(MaskTest, RandomBytesDoNoHarm) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> byte(40, 120);
  for (int round = 0; round < 20000; ++round) {
    std::string text(round % 12, ' ');
    for (char& c : text) c = static_cast<char>(byte(random));
    const auto mask = DecodeMask(PackedMaskRuns{6, 5, text}, 6, 5);
    if (mask.ok()) {
      EXPECT_EQ(mask->size(), 30u);
    }
  }
}

TEST(MaskTest, APolygonHasThePixelsWhoseCentreItHolds) {
  // A rectangle from (1, 0.6) to (3, 2.4) holds the centres of columns at 1.5 and 2.5, and of the
  // row at 1.5.
  const auto mask = DecodeMask(MaskPolygons{{1, 0.6, 3, 0.6, 3, 2.4, 1, 2.4}}, 4, 3);
  ASSERT_TRUE(mask.ok()) << mask.status();
  EXPECT_EQ(*mask, (Mask{0, 0, 0, 0,  //
                         0, 1, 1, 0,  //
                         0, 0, 0, 0}));
}

TEST(MaskTest, PolygonsAreUnitedAndCutOffAtTheImage) {
  const auto mask =
      DecodeMask(MaskPolygons{{-5, -5, 1, -5, 1, 9, -5, 9}, {3, 1, 9, 1, 9, 2, 3, 2}}, 4, 3);
  ASSERT_TRUE(mask.ok()) << mask.status();
  EXPECT_EQ(*mask, (Mask{1, 0, 0, 0,  //
                         1, 0, 0, 1,  //
                         1, 0, 0, 0}));
}

TEST(MaskTest, BrokenPolygonsAreRefused) {
  EXPECT_FALSE(DecodeMask(MaskPolygons{{0, 0, 1, 1}}, 4, 3).ok());
  EXPECT_FALSE(DecodeMask(MaskPolygons{{0, 0, 1, 1, 2}}, 4, 3).ok());
  EXPECT_FALSE(DecodeMask(MaskPolygons{{0, 0, 1e300, 1, 2, 5}}, 4, 3).ok());
}

}  // namespace
}  // namespace hypermap::ingest
