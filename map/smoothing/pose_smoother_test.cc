#include "map/smoothing/pose_smoother.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/cancellation/cancellation.h"
#include "map/observations/view_frame.h"
#include "map/smoothing/testing/rendered_room.h"

namespace hypermap::smoothing {
namespace {

const Eigen::Vector3d kSigma = LocalisationErrors::Sigma();

// A robot's drive with the errors of a localisation.
struct Drive {
  std::vector<PlanarTransform> truth;
  std::vector<View> views;

  void Add(const std::string& robot, uint32_t seed, int frames, double first_yaw = 0.0,
           const Eigen::Vector3d& sigma = kSigma) {
    LocalisationErrors errors(seed);
    int64_t number = 0;
    for (const PlanarTransform& pose : CircularDrive(frames, first_yaw)) {
      const PlanarTransform claimed = errors.Claim(pose);
      const Observation observation =
          SeenFrom(FurnishedRoom(), pose, claimed, sigma, robot, number++);
      truth.push_back(pose);
      views.push_back({robot,
                       {observation.stamp, ViewPose(observation.pose.frame_from_camera),
                        observation.pose.covariance},
                       DepthScan(observation)});
    }
  }

  // Root mean square of the distances from the true poses, of those from `begin` on.
  double Error(const std::vector<CorrectedPose>& poses, size_t begin = 0) const {
    double squares = 0.0;
    for (size_t i = begin; i < truth.size(); ++i) {
      const PlanarTransform& pose = poses[i].frame_from_view;
      squares += std::pow(pose.x() - truth[i].x(), 2) + std::pow(pose.y() - truth[i].y(), 2);
    }
    return std::sqrt(squares / static_cast<double>(truth.size() - begin));
  }
  std::vector<CorrectedPose> Claims() const {
    std::vector<CorrectedPose> claims;
    for (const View& view : views) claims.push_back(view.claim);
    return claims;
  }
};

TEST(PoseSmootherTest, CorrelatedErrorsAreAveragedOverADrive) {
  for (const uint32_t seed : {1, 2}) {
    Drive drive;
    drive.Add("a", seed, 100);
    const auto poses = SmoothPoses(drive.views, nullptr);
    ASSERT_TRUE(poses.ok()) << poses.status();
    EXPECT_LT(drive.Error(*poses), 0.8 * drive.Error(drive.Claims())) << seed;
  }
}

TEST(PoseSmootherTest, WallsGiveThePlaceInTheMap) {
  for (const uint32_t seed : {4, 5}) {
    Drive drive;
    drive.Add("a", seed, 100);
    const GridWalls walls(*GridOf(FurnishedRoom()), PlanarTransform());
    const auto poses = SmoothPoses(drive.views, &walls);
    ASSERT_TRUE(poses.ok()) << poses.status();
    // Half a cell.
    EXPECT_LT(drive.Error(*poses), 0.025) << seed;
    EXPECT_LT(drive.Error(*poses), 0.4 * drive.Error(drive.Claims())) << seed;
  }
}

TEST(PoseSmootherTest, AGridInAnotherFrameIsTheSame) {
  Drive drive;
  drive.Add("a", 4, 60);
  const PlanarTransform grid_from_frame(3.0, -2.0, 2.0);
  Drive moved = drive;
  for (View& view : moved.views) {
    view.claim.frame_from_view = grid_from_frame.Inverse() * view.claim.frame_from_view;
    view.claim.covariance = drive.views.front().claim.covariance;
  }
  const auto grid = GridOf(FurnishedRoom());
  const GridWalls walls(*grid, PlanarTransform());
  const GridWalls walls_of_moved(*grid, grid_from_frame);
  const auto poses = SmoothPoses(drive.views, &walls);
  const auto poses_of_moved = SmoothPoses(moved.views, &walls_of_moved);
  ASSERT_TRUE(poses.ok() && poses_of_moved.ok());
  for (size_t i = 0; i < poses->size(); ++i) {
    const PlanarTransform back = grid_from_frame * (*poses_of_moved)[i].frame_from_view;
    EXPECT_NEAR(back.x(), (*poses)[i].frame_from_view.x(), 0.002);
    EXPECT_NEAR(back.y(), (*poses)[i].frame_from_view.y(), 0.002);
  }
}

TEST(PoseSmootherTest, AnotherRobotsExactPosesAreAReferenceAndStay) {
  Drive drive;
  drive.Add("a", 7, 60);
  const double alone = drive.Error(*SmoothPoses(drive.views, nullptr));
  // The other robot's poses are exact.
  const size_t of_a = drive.views.size();
  int64_t number = 0;
  for (const PlanarTransform& pose : CircularDrive(60)) {
    const Observation observation =
        SeenFrom(FurnishedRoom(), pose, pose, {0.002, 0.002, 0.001}, "b", number++);
    drive.truth.push_back(pose);
    drive.views.push_back({"b",
                           {observation.stamp, ViewPose(observation.pose.frame_from_camera),
                            observation.pose.covariance},
                           DepthScan(observation)});
  }
  const auto poses = SmoothPoses(drive.views, nullptr);
  ASSERT_TRUE(poses.ok()) << poses.status();
  for (size_t i = of_a; i < poses->size(); ++i) {
    EXPECT_EQ((*poses)[i].frame_from_view, drive.views[i].claim.frame_from_view);
  }
  drive.truth.resize(of_a);
  EXPECT_LT(drive.Error(*poses), 0.01);
  EXPECT_LT(drive.Error(*poses), alone);
}

TEST(PoseSmootherTest, AViewThatNothingTiesKeepsItsClaim) {
  Drive drive;
  drive.Add("a", 8, 1);
  const auto poses = SmoothPoses(drive.views, nullptr);
  ASSERT_TRUE(poses.ok()) << poses.status();
  EXPECT_EQ(poses->front().frame_from_view, drive.views.front().claim.frame_from_view);
  EXPECT_EQ(poses->front().covariance, drive.views.front().claim.covariance);
  EXPECT_TRUE(SmoothPoses({}, nullptr)->empty());
}

TEST(PoseSmootherTest, TheSameViewsGiveTheSameBits) {
  Drive drive;
  drive.Add("a", 9, 40);
  drive.Add("b", 10, 40, 1.0);
  const auto once = SmoothPoses(drive.views, nullptr);
  const auto again = SmoothPoses(drive.views, nullptr);
  ASSERT_TRUE(once.ok() && again.ok());
  for (size_t i = 0; i < once->size(); ++i) {
    EXPECT_EQ((*once)[i].frame_from_view, (*again)[i].frame_from_view);
  }
}

TEST(PoseSmootherTest, ViewsThatNoCameraHasDoNoHarm) {
  Drive drive;
  drive.Add("good", 12, 60);
  const double claimed = drive.Error(drive.Claims());
  const double kHuge = std::numeric_limits<double>::max();
  Eigen::Matrix3d indefinite;
  indefinite << 1, 9, 0, 9, 1, 0, 0, 0, 1;
  const std::vector<Eigen::Matrix3d> covariances = {
      Eigen::Matrix3d::Zero(), kHuge * Eigen::Matrix3d::Identity(),
      Eigen::Matrix3d::Constant(kHuge), indefinite, Eigen::Matrix3d::Constant(1.0)};
  const std::vector<double> focals = {1e-300, 1e-30, 1e-3, 1.0, 1e300};
  const std::vector<double> centres = {0.0, -1e300, 1e30, 1e5};
  int64_t number = 0;
  for (const Eigen::Matrix3d& covariance : covariances) {
    for (const double focal : focals) {
      for (const double centre : centres) {
        const PlanarTransform pose(1e9, -1e9, 0.1);
        Observation observation =
            SeenFrom(FurnishedRoom(), PlanarTransform(), pose, kSigma, "zany", number++);
        observation.depth->fx = observation.depth->fy = focal;
        observation.depth->cx = centre;
        drive.views.push_back(
            {"zany", {observation.stamp, pose, covariance}, DepthScan(observation)});
      }
    }
  }
  const GridWalls walls(*GridOf(FurnishedRoom()), PlanarTransform());
  const auto poses = SmoothPoses(drive.views, &walls);
  ASSERT_TRUE(poses.ok()) << poses.status();
  EXPECT_LT(drive.Error(*poses), 0.5 * claimed);
  for (const CorrectedPose& pose : *poses) {
    EXPECT_TRUE(std::isfinite(pose.frame_from_view.x() + pose.frame_from_view.yaw()));
  }
}

TEST(PoseSmootherTest, EndsWhenItIsCancelled) {
  Drive drive;
  drive.Add("a", 11, 20);
  Cancellation cancellation([] { return absl::CancelledError("enough"); });
  const ScopedCancellation here(&cancellation);
  EXPECT_TRUE(absl::IsCancelled(SmoothPoses(drive.views, nullptr).status()));
}

}  // namespace
}  // namespace hypermap::smoothing
