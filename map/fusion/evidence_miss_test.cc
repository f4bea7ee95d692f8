#include "map/fusion/evidence_miss.h"

#include "gtest/gtest.h"
#include "map/fusion/testing/scene.h"

namespace hypermap::fusion {
namespace {

// A thin panel 2 m from the camera, of which all is near the visible surface, and a screen that
// hides it.
const SceneBox kPanel{"panel", Box{{2.0, -0.25}, {2.05, 0.25}}, {0.0, 0.6}};
const SceneBox kScreen{"screen", Box{{1.2, -1.5}, {1.25, 1.5}}, {0.0, 2.2}};

// A track of the panel, detected in ten views of weight 0.3.
Track PanelTrack() {
  Track track;
  track.key = "r/1/0";
  track.log_odds = 3.0;
  track.hits = 10;
  track.class_mass["panel"] = 5.0;
  track.low.Add(0.0, 1.0, -1.0);
  track.high.Add(0.6, 1.0, 1.0);
  track.outline = Polygon::FromBox(kPanel.footprint);
  track.looks = 10.0;
  track.found = 10.0;
  track.clarity = 3.0;
  return track;
}

// A frame of the scene, with the lookups of its depth image.
class Look {
 public:
  explicit Look(const std::vector<SceneBox>& scene, const SceneCamera& camera = {})
      : observation_(Observe(scene, camera, 1)),
        depth_(*observation_.depth, observation_.pose.frame_from_camera,
               EvidenceParameters().margin_m) {}
  Look(const Look&) = delete;
  Look& operator=(const Look&) = delete;

  const DepthLookup& depth() const { return depth_; }

 private:
  const Observation observation_;
  const DepthLookup depth_;
};

TEST(EvidenceMissTest, OccludedTrackLosesNothing) {
  Track track = PanelTrack();
  EXPECT_FALSE(SubtractMiss(Look({kScreen}).depth(), {}, &track));
  EXPECT_EQ(track.log_odds, 3.0);
  EXPECT_EQ(track.looks, 10.0);
  EXPECT_EQ(VisibilityOf(track, Look({kScreen}).depth()).visible, 0.0);
}

TEST(EvidenceMissTest, TrackOutOfViewLosesNothing) {
  Track track = PanelTrack();
  EXPECT_FALSE(SubtractMiss(Look({}, {.yaw_rad = 3.0}).depth(), {}, &track));
  EXPECT_EQ(track.log_odds, 3.0);
}

TEST(EvidenceMissTest, VisibilityDistinguishesEmptyFromOccupied) {
  const TrackVisibility gone = VisibilityOf(PanelTrack(), Look({}).depth());
  EXPECT_EQ(gone.visible, 1.0);
  EXPECT_EQ(gone.empty, 1.0);
  const TrackVisibility there = VisibilityOf(PanelTrack(), Look({kPanel}).depth());
  EXPECT_EQ(there.visible, 1.0);
  EXPECT_EQ(there.empty, 0.0);
}

TEST(EvidenceMissTest, EmptyPlaceTakesMoreThanThingNotDetected) {
  const EvidenceParameters parameters;
  Track gone = PanelTrack();
  ASSERT_TRUE(SubtractMiss(Look({}).depth(), parameters, &gone));
  Track overlooked = PanelTrack();
  ASSERT_TRUE(SubtractMiss(Look({kPanel}).depth(), parameters, &overlooked));
  EXPECT_LT(overlooked.log_odds, 3.0);
  EXPECT_LT(gone.log_odds, overlooked.log_odds);
  EXPECT_GE(gone.log_odds, 3.0 - parameters.empty_loss);
}

TEST(EvidenceMissTest, FarViewTakesLess) {
  Track near = PanelTrack();
  ASSERT_TRUE(SubtractMiss(Look({}).depth(), {}, &near));
  Track far = PanelTrack();
  ASSERT_TRUE(SubtractMiss(Look({}, {.x = -1.5}).depth(), {}, &far));
  EXPECT_LT(far.log_odds, 3.0);
  EXPECT_GT(far.log_odds, near.log_odds);
}

}  // namespace
}  // namespace hypermap::fusion
