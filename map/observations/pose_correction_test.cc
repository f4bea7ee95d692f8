#include "map/observations/pose_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "map/observations/view_frame.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;

const absl::Time kStamp = absl::FromUnixSeconds(1'700'000'000);

CorrectedPose At(double s, double x, double yaw, double variance = 0.0) {
  return {kStamp + absl::Seconds(s), PlanarTransform(x, 0.0, yaw),
          variance * Eigen::Matrix3d::Identity()};
}

// A camera that looks along `yaw`, and down by `pitch`.
Eigen::Isometry3d Camera(double x, double y, double yaw, double pitch) {
  Eigen::Matrix3d optical;  // Looks along x; z is up.
  optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) * optical;
  pose.translation() = Eigen::Vector3d(x, y, 1.2);
  return pose;
}

TEST(PoseAtTest, InterpolatesOverShortGapsOnly) {
  const std::vector<CorrectedPose> poses = {At(0.0, 1.0, 3.1, 1.0), At(0.4, 2.0, -3.1, 3.0),
                                            At(1.0, 5.0, 0.0)};
  EXPECT_FALSE(PoseAt(poses, kStamp - absl::Nanoseconds(1)));
  EXPECT_EQ(PoseAt(poses, kStamp)->frame_from_view, poses[0].frame_from_view);
  const auto half = PoseAt(poses, kStamp + absl::Milliseconds(200));
  ASSERT_TRUE(half);
  EXPECT_DOUBLE_EQ(half->frame_from_view.x(), 1.5);
  EXPECT_NEAR(std::abs(half->frame_from_view.yaw()), M_PI, 1e-12);  // The shorter way round.
  EXPECT_DOUBLE_EQ(half->covariance(0, 0), 2.0);
  EXPECT_FALSE(PoseAt(poses, kStamp + absl::Milliseconds(700)));
  EXPECT_TRUE(PoseAt(poses, kStamp + absl::Seconds(1)));
  EXPECT_FALSE(PoseAt(poses, kStamp + absl::Milliseconds(1001)));
}

TEST(WithPoseTest, MovesEverythingWithTheCamera) {
  Observation observation;
  observation.robot = "a";
  observation.pose = {Camera(1.0, 0.0, 0.0, 0.2), Eigen::Matrix3d::Identity()};
  observation.free_space = Polygon::FromBox({{2.0, 0.0}, {3.0, 1.0}});
  Detection detection;
  detection.scores = {{"cup", 0.9}};
  detection.hull = observation.free_space;
  detection.cells.frame_from_cells = PlanarTransform(2.0, 0.0, 0.0);
  observation.detections = {detection};
  const CorrectedPose pose{kStamp, PlanarTransform(5.0, 5.0, M_PI / 2)};
  const Observation moved = *WithPose(observation, pose);
  const PlanarTransform view = ViewPose(moved.pose.frame_from_camera);
  EXPECT_NEAR(view.x(), 5.0, 1e-12);
  EXPECT_NEAR(view.yaw(), M_PI / 2, 1e-12);
  EXPECT_EQ(moved.pose.frame_from_camera.translation().z(), 1.2);
  EXPECT_TRUE(moved.pose.covariance.isZero(0.0));
  // A metre ahead, and half a metre to the left.
  for (const Point& centre : {Centroid(moved.free_space), Centroid(moved.detections[0].hull)}) {
    EXPECT_NEAR(centre.x, 4.5, 1e-9);
    EXPECT_NEAR(centre.y, 6.5, 1e-9);
  }
  EXPECT_NEAR(moved.detections[0].cells.frame_from_cells.y(), 6.0, 1e-9);
}

// The poses' digits are such that every way of computing rounds differently.
TEST(WithPoseTest, AViewGetsThePoseToTheLastBit) {
  const auto seen_from = [](const CorrectedPose& pose) {
    Observation observation;
    observation.robot = "a";
    observation.frame_from_view = pose.frame_from_view;
    observation.pose = {ViewFromCamera(Eigen::Vector3d(0.01, -0.95, -0.3).normalized(), 1.1),
                        pose.covariance};
    observation.view_hull = Polygon::FromBox({{0.1, -2.3}, {4.7, 2.9}});
    observation.free_space = Polygon::FromBox({{0.3, -0.7}, {1.7, 0.9}});
    Detection detection;
    detection.scores = {{"cup", 0.9}};
    detection.hull = Polygon::FromBox({{2.3, -0.1}, {2.7, 0.1}});
    observation.detections = {detection};
    return observation;
  };
  for (int i = 1; i < 50; ++i) {
    const CorrectedPose claimed = At(0.0, i / 3.0, i / 7.0, 0.1 / i);
    const CorrectedPose corrected = At(0.0, i / 11.0, -i / 13.0, 0.01 / i);
    const Observation moved = *WithPose(seen_from(claimed), corrected);
    const Observation sent = Placed(seen_from(corrected));
    EXPECT_FALSE(moved.frame_from_view);
    EXPECT_EQ(moved.pose.frame_from_camera.matrix(), sent.pose.frame_from_camera.matrix());
    EXPECT_EQ(moved.pose.covariance, sent.pose.covariance);
    EXPECT_EQ(moved.view_hull, sent.view_hull);
    EXPECT_EQ(moved.free_space, sent.free_space);
    EXPECT_EQ(moved.detections, sent.detections);
  }
}

TEST(WithPoseTest, RefusesPlacesThatCanNotBeStored) {
  Observation observation;
  observation.robot = "a";
  observation.pose.frame_from_camera = Camera(0.0, 0.0, 0.0, 0.0);
  observation.view_hull = Polygon::FromBox({{0.0, 0.0}, {8.0, 1.0}});
  EXPECT_TRUE(WithPose(observation, At(0.0, 9.9e8, 0.0)));
  EXPECT_FALSE(WithPose(observation, At(0.0, 1e9, 0.0)));
  EXPECT_TRUE(WithPose(observation, At(0.0, 1e9, M_PI)));
  Detection detection;
  detection.hull = Polygon::FromBox({{-8.0, 0.0}, {-7.0, 1.0}});
  observation.detections = {detection};
  EXPECT_FALSE(WithPose(observation, At(0.0, 1e9, M_PI)));
}

TEST(PoseCorrectionTest, ErrorsNameTheField) {
  const auto error = [](const PoseCorrection& correction) {
    return std::string(Validate(correction).message());
  };
  EXPECT_EQ(error({"a", {At(0, 0, 0), At(1, 0, 0)}}), "");
  EXPECT_THAT(error({"", {At(0, 0, 0)}}), HasSubstr("robot"));
  EXPECT_THAT(error({"a", {}}), HasSubstr("poses are empty"));
  EXPECT_THAT(error({"a", {At(0, 0, 0), At(0, 1, 0)}}), HasSubstr("poses[1].stamp"));
  EXPECT_THAT(error({"a", {At(0, 1e12, 0)}}), HasSubstr("poses[0].pose"));
  EXPECT_THAT(error({"a", {At(0, 0, 0, -1.0)}}), HasSubstr("poses[0].covariance"));
  PoseCorrection many{"a", std::vector<CorrectedPose>(kMaxCorrectedPoses + 1, At(0, 0, 0))};
  EXPECT_THAT(error(many), HasSubstr("poses are more than 100000"));
}

}  // namespace
}  // namespace hypermap
