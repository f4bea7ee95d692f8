#include <algorithm>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "ingest/perception/segmenter.h"
#include "ingest/perception/testing/box_scene.h"

namespace hypermap::ingest {
namespace {

using testing::BoxScene;
using testing::Grown;
using ::testing::IsEmpty;
using testing::LookFrom;
using testing::Mask;
using testing::Photograph;
using testing::Shot;
using testing::TestCamera;

constexpr int kSegmented = 0;

// Quality of a segmentation: the share of the object's pixels that was lost, and the share of the
// mask's other pixels that was kept.
struct Shares {
  double lost = 0.0;
  double background = 0.0;
};

Shares SharesOf(const Shot& shot, const Mask& mask) {
  const auto kept = MakeOrganisedSegmenter()->Segment(shot.Cloud(), mask);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  Mask is_kept(mask.size(), 0);
  for (const int32_t pixel : kept) {
    EXPECT_TRUE(mask[pixel]) << "outside of the mask";
    EXPECT_FALSE(is_kept[pixel]) << "twice";
    is_kept[pixel] = 1;
  }
  double thing = 0;
  double lost = 0;
  double others = 0;
  double others_kept = 0;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i] || shot.depth.metres[i] == 0.0f) continue;
    if (shot.seen[i] == kSegmented) {
      ++thing;
      lost += !is_kept[i];
    } else {
      ++others;
      others_kept += is_kept[i];
    }
  }
  return {lost / thing, others == 0 ? 0.0 : others_kept / others};
}

// An object on a table, about 1.4 m ahead of the camera.
BoxScene OnTable(const testing::Cuboid& thing) {
  return {true, {thing, {{1.0, -0.8, 0.70}, {2.0, 0.8, 0.74}}}};
}

Shot Seen(const BoxScene& scene, std::optional<uint64_t> noise_seed) {
  return Photograph(scene, TestCamera(320), LookFrom({0, 0, 1.4}, 0.0, 0.4), noise_seed);
}

TEST(OrganisedSegmenterTest, BoxIsKeptAndTheTableAroundDropped) {
  const BoxScene scene = OnTable({{1.3, -0.12, 0.74}, {1.5, 0.12, 0.98}});
  for (const auto noise_seed : {std::optional<uint64_t>(), std::optional<uint64_t>(17)}) {
    const Shot shot = Seen(scene, noise_seed);
    const Shares shares = SharesOf(shot, Grown(shot.MaskOf(kSegmented), 320, 8));
    EXPECT_LE(shares.lost, 0.05) << (noise_seed ? "with noise" : "exact");
    EXPECT_LE(shares.background, 0.03) << (noise_seed ? "with noise" : "exact");
  }
}

TEST(OrganisedSegmenterTest, FlatThingInAnExactMaskIsKept) {
  for (const double thickness_m : {0.002, 0.006, 0.02, 0.04}) {
    const BoxScene scene = OnTable({{1.3, -0.15, 0.74}, {1.52, 0.15, 0.74 + thickness_m}});
    for (const auto noise_seed : {std::optional<uint64_t>(), std::optional<uint64_t>(18)}) {
      const Shot shot = Seen(scene, noise_seed);
      EXPECT_LE(SharesOf(shot, shot.MaskOf(kSegmented)).lost, 0.05)
          << thickness_m << (noise_seed ? " with noise" : " exact");
    }
  }
}

TEST(OrganisedSegmenterTest, WallFarBehindIsDropped) {
  const BoxScene scene{true, {{{1.3, -0.15, 0.5}, {1.5, 0.15, 1.1}}, {{3.5, -5, 0}, {3.6, 5, 3}}}};
  for (const auto noise_seed : {std::optional<uint64_t>(), std::optional<uint64_t>(19)}) {
    const Shot shot =
        Photograph(scene, TestCamera(320), LookFrom({0, 0, 1.0}, 0.0, 0.0), noise_seed);
    const Shares shares = SharesOf(shot, Grown(shot.MaskOf(kSegmented), 320, 8));
    EXPECT_LE(shares.lost, 0.05) << (noise_seed ? "with noise" : "exact");
    EXPECT_LE(shares.background, 0.03) << (noise_seed ? "with noise" : "exact");
  }
}

// A post hides the middle of the object: its mask has two components at the same distance.
TEST(OrganisedSegmenterTest, PartsOnBothSidesOfAnOccluderAreKept) {
  const BoxScene scene{true,
                       {{{2.0, -0.5, 0}, {2.3, 0.5, 0.8}}, {{1.2, -0.04, 0}, {1.25, 0.04, 1.5}}}};
  const Shot shot = Photograph(scene, TestCamera(320), LookFrom({0, 0, 1.0}, 0.0, 0.3), 20);
  EXPECT_LE(SharesOf(shot, shot.MaskOf(kSegmented)).lost, 0.05);
}

// The mask has more than 60,000 pixels, so that it is thinned.
TEST(OrganisedSegmenterTest, ThingThatFillsMostOfTheImageIsKept) {
  const BoxScene scene{true,
                       {{{1.0, -0.55, 0.55}, {1.3, 0.55, 1.45}}, {{4.0, -9, 0}, {4.1, 9, 3}}}};
  const Shot shot = Photograph(scene, TestCamera(320), LookFrom({0, 0, 1.0}, 0.0, 0.0), 21);
  const Mask mask = Grown(shot.MaskOf(kSegmented), 320, 4);
  ASSERT_GT(std::count(mask.begin(), mask.end(), 1), 60000);
  const Shares shares = SharesOf(shot, mask);
  EXPECT_LE(shares.lost, 0.05);
  EXPECT_LE(shares.background, 0.03);
}

TEST(OrganisedSegmenterTest, NothingIsKeptOfMasksWithoutReturns) {
  Shot shot = Photograph({}, TestCamera(40), LookFrom({0, 0, 1.0}, 0.0, 0.5));
  const auto segmenter = MakeOrganisedSegmenter();
  EXPECT_THAT(segmenter->Segment(shot.Cloud(), Mask(1200, 0)), IsEmpty());
  shot.depth.metres.assign(1200, 0.0f);
  EXPECT_THAT(segmenter->Segment(shot.Cloud(), Mask(1200, 1)), IsEmpty());
}

// There is no ring around the mask in which background planes could be found.
TEST(OrganisedSegmenterTest, MaskOfTheWholeImageIsKept) {
  const Shot shot = Photograph({}, TestCamera(320), LookFrom({0, 0, 1.0}, 0.0, 0.7));
  const Mask all(shot.seen.size(), 1);
  EXPECT_EQ(MakeOrganisedSegmenter()->Segment(shot.Cloud(), all).size(), all.size());
}

}  // namespace
}  // namespace hypermap::ingest
