#include "server/session/pose_smoothing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "map/observations/view_frame.h"
#include "map/smoothing/testing/rendered_room.h"
#include "server/session/object_history.h"
#include "server/session/testing/fused_site.h"

namespace hypermap::server {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int kFrames = 40;

absl::Status GoOn() { return absl::OkStatus(); }

// A detection of a square of 20 cm, 1 m in front of a camera.
Detection CupBefore(const PlanarTransform& pose) {
  Detection detection;
  detection.scores = {{"cup", 0.9}};
  detection.hull = pose * Polygon::FromBox({{0.9, -0.1}, {1.1, 0.1}});
  detection.cells.frame_from_cells = pose * PlanarTransform(0.9, -0.1, 0.0);
  detection.cells.resolution_m = 0.05;
  for (int row = 0; row < 4; ++row) detection.cells.spans.push_back({row, 0, 4});
  detection.height = {0.7, 0.8};
  detection.num_points = 50;
  detection.range_m = 1.0;
  return detection;
}

// The observations of a robot that is localised badly, each with a cup.
std::vector<Observation> BadlyLocalised(const std::string& robot, uint32_t seed) {
  smoothing::LocalisationErrors errors(seed);
  std::vector<Observation> observations;
  for (const PlanarTransform& pose : smoothing::CircularDrive(kFrames)) {
    const PlanarTransform claimed = errors.Claim(pose);
    observations.push_back(smoothing::SeenFrom(smoothing::FurnishedRoom(), pose, claimed,
                                               smoothing::LocalisationErrors::Sigma(), robot,
                                               static_cast<int64_t>(observations.size())));
    observations.back().detections.push_back(CupBefore(claimed));
  }
  return observations;
}

absl::StatusOr<SmoothedPoses> Smooth(FusedSite& site, const std::string& grid = "") {
  return SmoothPoses(site.session(), "things", grid, GoOn);
}

absl::Status Apply(FusedSite& site, const SmoothedPoses& smoothed) {
  return site.Run(CorrectPoses{"things", smoothed.frame_id, smoothed.corrections}).status();
}

// Adds the room's occupancy grid as a layer.
void AddGrid(FusedSite& site, const std::string& name) {
  const auto grid = smoothing::GridOf(smoothing::FurnishedRoom());
  LayerSpec spec = grid->spec();
  spec.name = name;
  const CellBox& box = grid->extent();
  std::vector<std::optional<double>> values;
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      values.push_back(grid->ValueAt({row, col}));
    }
  }
  ASSERT_TRUE(site.Edit({{CreateLayer{spec}, WriteCells{name, box, values}}}).ok());
}

TEST(PoseSmoothingTest, TheLayerIsThatOfADriveThatClaimedThesePoses) {
  FusedSite site;
  FusedSite claimed;
  for (FusedSite* s : {&site, &claimed}) s->Start();
  for (const std::string robot : {"a", "b"}) {
    for (const Observation& o : BadlyLocalised(robot, robot == "a" ? 1 : 2)) site.Observe(o);
  }
  const auto smoothed = Smooth(site);
  ASSERT_TRUE(smoothed.ok()) << smoothed.status();
  EXPECT_EQ(smoothed->matched, 2 * kFrames);
  EXPECT_GT(smoothed->moved, kFrames);
  EXPECT_GT(smoothed->rms_shift_m, 0.01);
  EXPECT_EQ(smoothed->occupancy_layer, "");
  ASSERT_THAT(smoothed->corrections, SizeIs(2));
  const Revision before = site.snapshot()->revision;
  ASSERT_TRUE(Apply(site, *smoothed).ok());
  EXPECT_EQ(site.snapshot()->revision, before + 1);
  for (const PoseCorrection& correction : smoothed->corrections) {
    EXPECT_TRUE(correction.is_smoothed);
    for (const Observation& o : BadlyLocalised(correction.robot, correction.robot == "a" ? 1 : 2)) {
      claimed.Observe(*WithPose(o, *PoseAt(correction.poses, o.stamp)));
    }
  }
  ExpectShowsTheSame(site, claimed);
  // A second time there is nothing to move, also when the corrections come from the store.
  EXPECT_THAT(Smooth(site)->corrections, IsEmpty());
  site.Restart();
  EXPECT_THAT(Smooth(site)->corrections, IsEmpty());
  ExpectShowsTheSame(site, claimed);
}

TEST(PoseSmoothingTest, WallsOfTheOnlyGridAreUsed) {
  FusedSite site;
  site.Start();
  for (const Observation& o : BadlyLocalised("a", 3)) site.Observe(o);
  AddGrid(site, "walls");
  const auto smoothed = Smooth(site);
  ASSERT_TRUE(smoothed.ok()) << smoothed.status();
  EXPECT_EQ(smoothed->occupancy_layer, "walls");
  const std::vector<PlanarTransform> truth = smoothing::CircularDrive(kFrames);
  double squares = 0.0;
  for (int i = 0; i < kFrames; ++i) {
    const PlanarTransform& pose = smoothed->corrections.front().poses[i].frame_from_view;
    squares += std::pow(pose.x() - truth[i].x(), 2) + std::pow(pose.y() - truth[i].y(), 2);
  }
  EXPECT_LT(std::sqrt(squares / kFrames), 0.03);
  // Of two grids one must be named.
  AddGrid(site, "more");
  EXPECT_EQ(Smooth(site)->occupancy_layer, "");
  EXPECT_EQ(Smooth(site, "more")->occupancy_layer, "more");
}

TEST(PoseSmoothingTest, PosesThatARobotTellsLaterAreTheBeginning) {
  FusedSite site;
  site.Start();
  const std::vector<PlanarTransform> truth = smoothing::CircularDrive(kFrames);
  PoseCorrection exact{"a", {}};
  for (const Observation& o : BadlyLocalised("a", 4)) {
    site.Observe(o);
    exact.poses.push_back({o.stamp, truth[o.sequence], 1e-6 * Eigen::Matrix3d::Identity()});
  }
  ASSERT_TRUE(Apply(site, *Smooth(site)).ok());
  ASSERT_TRUE(site.Run(CorrectPoses{"things", "", {exact}}).ok());
  // They are exact, and stay.
  EXPECT_THAT(Smooth(site)->corrections, IsEmpty());
  // Poses that were smoothed before the robot told its own do not come back.
  FusedSite told;
  told.Start();
  for (const Observation& o : BadlyLocalised("a", 4)) {
    told.Observe(*WithPose(o, exact.poses[o.sequence]));
  }
  ExpectShowsTheSame(site, told);
}

TEST(PoseSmoothingTest, AMatchedPoseGivesWayToItsClaimOnlyWhereThereAreWalls) {
  FusedSite site;
  site.Start();
  for (Observation o : BadlyLocalised("a", 5)) {
    // Matched to a grid that is 1 m off, with much confidence.
    const PoseClaim claim{ViewPose(o.pose.frame_from_camera), o.pose.covariance};
    o = *WithPose(o, {o.stamp, PlanarTransform(1.0, 0.0, 0.0) * claim.frame_from_view,
                      0.1 * claim.covariance});
    o.claim = claim;
    site.Observe(o);
  }
  const PlanarTransform first = smoothing::CircularDrive(1).front();
  const auto without = Smooth(site);
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_NEAR(without->corrections.front().poses.front().frame_from_view.x(), first.x() + 1.0, 0.2);
  AddGrid(site, "walls");
  const auto with = Smooth(site);
  ASSERT_TRUE(with.ok()) << with.status();
  EXPECT_NEAR(with->corrections.front().poses.front().frame_from_view.x(), first.x(), 0.1);
}

TEST(PoseSmoothingTest, WhatCannotBeSmoothedIsTold) {
  FusedSite site;
  EXPECT_TRUE(absl::IsFailedPrecondition(Smooth(site).status()));  // Not fused.
  site.Start();
  EXPECT_THAT(Smooth(site)->corrections, IsEmpty());
  site.Observe(Sighting("a", 1, 10, {"cup"}));  // Has no depth.
  EXPECT_EQ(Smooth(site)->matched, 0);
  for (const Observation& o : BadlyLocalised("b", 6)) site.Observe(o);
  EXPECT_TRUE(absl::IsInvalidArgument(Smooth(site, "seen").status()));
  EXPECT_TRUE(absl::IsNotFound(Smooth(site, "nothing").status()));
  EXPECT_TRUE(absl::IsNotFound(SmoothPoses(site.session(), "nothing", "", GoOn).status()));
  EXPECT_TRUE(absl::IsCancelled(
      SmoothPoses(site.session(), "things", "", [] { return absl::CancelledError(""); }).status()));
}

TEST(PoseSmoothingTest, AnExplanationIsOfTheCorrectedObservations) {
  FusedSite site;
  site.options().fusion.make_strategy = &fusion::MakeStrategy;
  site.options().fusion.default_strategy = "evidence";
  site.Restart();
  site.Start();
  const PlanarTransform pose(1.0, 0.5, 0.3);
  PoseCorrection correction{"a", {}};
  for (int i = 0; i < 8; ++i) {
    // Every second observation is said to be a metre beside the place, where it founds another cup.
    const PlanarTransform claimed = i % 2 == 0 ? pose : PlanarTransform(1.0, 1.5, 0.3);
    Observation o =
        smoothing::SeenFrom(smoothing::FurnishedRoom(), pose, claimed, {0.02, 0.02, 0.01}, "a", i);
    o.detections.push_back(CupBefore(claimed));
    site.Observe(o);
    correction.poses.push_back({o.stamp, pose, 1e-4 * Eigen::Matrix3d::Identity()});
  }
  ASSERT_TRUE(site.Run(CorrectPoses{"things", "", {correction}}).ok());
  ASSERT_NE(site.Find("cup"), nullptr);
  const auto history = ExplainObject(site.session(), "things", site.Find("cup")->id, GoOn);
  ASSERT_TRUE(history.ok()) << history.status();
  EXPECT_THAT(history->events, SizeIs(8));
}

}  // namespace
}  // namespace hypermap::server
