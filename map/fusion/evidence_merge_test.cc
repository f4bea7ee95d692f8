#include "map/fusion/evidence_merge.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::fusion {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

// A track of a chair that was detected `hits` times and covers `box`.
FrameTrack ChairAt(const TrackKey& key, const Box& box, int hits) {
  FrameTrack chair;
  chair.hit = true;
  chair.track = std::make_shared<Track>();
  Track& track = *chair.track;
  track.key = key;
  track.hits = hits;
  track.class_mass["chair"] = 1.0;
  track.low.Add(0.0, 1.0, -1.0);
  track.high.Add(0.9, 1.0, 1.0);
  track.shape = ShapeGrid(0.025);
  ForEachSpan(Polygon::FromBox(box), 0.025, [&](int32_t row, int32_t begin, int32_t end) {
    for (int32_t col = begin; col < end; ++col) track.shape.AddHit({row, col}, 1.0f);
  });
  track.Refresh({});
  return chair;
}

FrameDetection DetectionAt(const Box& box) {
  FrameDetection detection;
  detection.label = "chair";
  detection.hull = Polygon::FromBox(box);
  return detection;
}

const Box kPlace{{0.0, 0.0}, {0.5, 0.5}};
const Box kNearby{{0.1, 0.0}, {0.6, 0.5}};

TEST(EvidenceMergeTest, KeepsTheTrackWithMoreHits) {
  for (const bool first_has_more : {true, false}) {
    std::vector<FrameTrack> tracks = {ChairAt("a", kPlace, first_has_more ? 9 : 2),
                                      ChairAt("b", kNearby, first_has_more ? 2 : 9)};
    const auto merged = MergeTracks({}, 0.02, {}, &tracks);
    if (first_has_more) {
      EXPECT_THAT(merged, ElementsAre(Pair("b", "a")));
    } else {
      EXPECT_THAT(merged, ElementsAre(Pair("a", "b")));
    }
    const FrameTrack& kept = tracks[first_has_more ? 0 : 1];
    EXPECT_EQ(tracks[first_has_more ? 1 : 0].track, nullptr);
    ASSERT_NE(kept.track, nullptr);
    EXPECT_EQ(kept.track->hits, 11);
  }
}

TEST(EvidenceMergeTest, TracksThatWereNotHitStay) {
  std::vector<FrameTrack> tracks = {ChairAt("a", kPlace, 9), ChairAt("b", kNearby, 2)};
  tracks[0].hit = tracks[1].hit = false;
  EXPECT_THAT(MergeTracks({}, 0.02, {}, &tracks), IsEmpty());
}

TEST(EvidenceMergeTest, TracksAtOtherHeightsStay) {
  std::vector<FrameTrack> tracks = {ChairAt("a", kPlace, 9), ChairAt("b", kNearby, 2)};
  tracks[1].track->low = tracks[1].track->high = {};
  tracks[1].track->low.Add(1.5, 1.0, -1.0);
  tracks[1].track->high.Add(1.8, 1.0, 1.0);
  EXPECT_THAT(MergeTracks({}, 0.02, {}, &tracks), IsEmpty());
}

TEST(EvidenceMergeTest, TracksDetectedInOneFrameStay) {
  const std::vector<FrameDetection> detections = {DetectionAt(kPlace), DetectionAt(kNearby)};
  std::vector<FrameTrack> tracks = {ChairAt("a", kPlace, 9), ChairAt("b", kNearby, 2)};
  tracks[0].detection = 0;
  tracks[1].detection = 1;
  CountApart(detections, {}, &tracks);
  EXPECT_THAT(tracks[0].track->apart, ElementsAre(Pair("b", 1)));
  EXPECT_THAT(tracks[1].track->apart, ElementsAre(Pair("a", 1)));
  EXPECT_THAT(MergeTracks(detections, 0.02, {}, &tracks), IsEmpty());
}

TEST(EvidenceMergeTest, ThingsFarApartAreNotCounted) {
  const Box far{{1.1, 0.0}, {1.6, 0.5}};
  const std::vector<FrameDetection> detections = {DetectionAt(kPlace), DetectionAt(far)};
  std::vector<FrameTrack> tracks = {ChairAt("a", kPlace, 9), ChairAt("b", far, 2)};
  tracks[0].detection = 0;
  tracks[1].detection = 1;
  CountApart(detections, {}, &tracks);
  EXPECT_THAT(tracks[0].track->apart, IsEmpty());
  CountApart(detections, {.side_by_side_m = 1.0}, &tracks);
  EXPECT_THAT(tracks[0].track->apart, ElementsAre(Pair("b", 1)));
}

// Overlap that suffices for parts of one thing only: IoU 0.25.
TEST(EvidenceMergeTest, PartsAreMergedAfterEnoughHits) {
  const Box part{{0.3, 0.0}, {0.8, 0.5}};
  for (const int hits : {2, 3}) {
    std::vector<FrameTrack> tracks = {ChairAt("a", kPlace, hits), ChairAt("b", part, 3)};
    EXPECT_EQ(MergeTracks({}, 0.0, {}, &tracks).size(), hits == 3 ? 1u : 0u) << hits;
    tracks = {ChairAt("a", kPlace, hits), ChairAt("b", part, 3)};
    EXPECT_EQ(MergeTracks({}, 0.0, {.merge_parts_hits = 5.0}, &tracks).size(), 1u) << hits;
  }
}

}  // namespace
}  // namespace hypermap::fusion
