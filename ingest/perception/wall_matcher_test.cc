#include "ingest/perception/wall_matcher.h"

#include <cmath>
#include <limits>

#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "ingest/perception/testing/walled_room.h"

namespace hypermap::ingest {
namespace {

using testing::GridWithoutWalls;
using testing::LookFrom;
using testing::Photograph;
using testing::Shot;
using testing::TestCamera;
using testing::WalledRoom;
using testing::WalledRoomGrid;

constexpr double kHeight_m = 0.9;
constexpr double kDown_rad = 0.25;

// A diagonal covariance, from standard deviations.
Eigen::Matrix3d Prior(double xy_m, double yaw_rad) {
  return Eigen::Vector3d(xy_m * xy_m, xy_m * xy_m, yaw_rad * yaw_rad).asDiagonal();
}

// An image with noise of the walled room, taken from `truth` (x, y, yaw).
Shot From(const Eigen::Vector3d& truth) {
  return Photograph(WalledRoom(), TestCamera(160),
                    LookFrom({truth.x(), truth.y(), kHeight_m}, truth.z(), kDown_rad), 41);
}

// The cloud of a robot that is at `truth` and believes to be at `truth + error`.
OrganisedCloud Claimed(const Eigen::Vector3d& truth, const Eigen::Vector3d& error) {
  const Eigen::Vector3d at = truth + error;
  return From(truth).CloudAt(LookFrom({at.x(), at.y(), kHeight_m}, at.z(), kDown_rad));
}

const Eigen::Vector3d kBeforeACorner(-0.8, -0.7, 0.55);
const Eigen::Vector3d kBeforeAWall(0.8, 0.0, 0.0);

TEST(WallMatcherTest, PoseErrorIsCorrected) {
  const WallMatcher matcher(*WalledRoomGrid());
  const Eigen::Vector3d errors[] = {
      {0.06, 0, 0}, {0, -0.06, 0}, {0, 0, 0.03}, {-0.05, 0.05, -0.02}, {0.08, 0.06, 0.025}};
  for (const Eigen::Vector3d& error : errors) {
    const PoseCorrection correction =
        matcher.Match(Claimed(kBeforeACorner, error), Prior(0.08, 0.04));
    const Eigen::Vector3d left = error + correction.motion;
    EXPECT_LT(left.head<2>().norm(), 0.02) << error.transpose();
    EXPECT_LT(std::abs(left.z()), 0.006) << error.transpose() << " left " << left.transpose();
  }
}

TEST(WallMatcherTest, APoseThatIsKnownBetterThanTheGridStays) {
  const WallMatcher matcher(*WalledRoomGrid());
  const OrganisedCloud cloud = Claimed(kBeforeACorner, {0.03, 0.0, 0.0});
  const PoseCorrection known = matcher.Match(cloud, Prior(0.01, 0.005));
  EXPECT_EQ(known.motion, Eigen::Vector3d::Zero().eval());
  EXPECT_EQ(known.covariance, Prior(0.01, 0.005));
  for (const Eigen::Matrix3d& prior : {Prior(0.011, 0.005), Prior(0.01, 0.006)}) {
    EXPECT_NE(matcher.Match(cloud, prior).motion, Eigen::Vector3d::Zero().eval());
  }
}

TEST(WallMatcherTest, RightPoseStaysWhereItIs) {
  const PoseCorrection correction =
      WallMatcher(*WalledRoomGrid())
          .Match(Claimed(kBeforeACorner, Eigen::Vector3d::Zero()), Prior(0.08, 0.04));
  EXPECT_LT(correction.motion.head<2>().norm(), 0.015);
  EXPECT_LT(std::abs(correction.motion.z()), 0.005);
}

// A single wall does not tell where along it the robot stands.
TEST(WallMatcherTest, CorrectsOnlyWhatTheWallsTell) {
  const Eigen::Matrix3d prior = Prior(0.08, 0.04);
  const PoseCorrection correction =
      WallMatcher(*WalledRoomGrid()).Match(Claimed(kBeforeAWall, {0.06, 0.06, 0}), prior);
  EXPECT_NEAR(correction.motion.x(), -0.06, 0.015);
  EXPECT_LT(std::abs(correction.motion.y()), 0.015);
  EXPECT_LT(correction.covariance(0, 0), 0.3 * prior(0, 0));
  EXPECT_GT(correction.covariance(1, 1), 0.7 * prior(1, 1));
  EXPECT_LE(correction.covariance(1, 1), 1.0001 * prior(1, 1));
}

TEST(WallMatcherTest, PoseThatIsExactIsNotMoved) {
  const WallMatcher matcher(*WalledRoomGrid());
  const PoseCorrection correction =
      matcher.Match(Claimed(kBeforeACorner, {0.06, 0, 0}), Eigen::Matrix3d::Zero());
  EXPECT_EQ(correction.motion, Eigen::Vector3d::Zero());
  EXPECT_EQ(correction.covariance, Eigen::Matrix3d::Zero());
}

TEST(WallMatcherTest, WithoutWallsNothingMoves) {
  const Eigen::Matrix3d prior = Prior(0.08, 0.04);
  const OrganisedCloud room = Claimed(kBeforeACorner, {0.06, 0, 0});
  const PoseCorrection on_empty_grid = WallMatcher(*GridWithoutWalls()).Match(room, prior);
  EXPECT_LT(on_empty_grid.motion.norm(), 1e-12);
  EXPECT_TRUE(on_empty_grid.covariance.isApprox(prior, 1e-9));

  const OrganisedCloud floor =
      Photograph({}, TestCamera(160), LookFrom({0, 0, kHeight_m}, 0, 0.6)).Cloud();
  const PoseCorrection of_floor = WallMatcher(*WalledRoomGrid()).Match(floor, prior);
  EXPECT_EQ(of_floor.motion, Eigen::Vector3d::Zero());
  EXPECT_EQ(of_floor.covariance, prior);
}

TEST(WallMatcherTest, CorrectionStaysWithinThePrior) {
  const WallMatcher matcher(*WalledRoomGrid());
  for (const double error_m : {0.15, 0.3, 0.45, 1.0, 10.0}) {
    const PoseCorrection correction =
        matcher.Match(Claimed(kBeforeACorner, {error_m, -error_m, 0.1}), Prior(0.01, 0.005));
    EXPECT_LT(correction.motion.head<2>().norm(), 4 * 0.01) << error_m;
    EXPECT_LT(std::abs(correction.motion.z()), 4 * 0.005) << error_m;
  }
}

TEST(WallMatcherTest, SameFrameGivesTheSameCorrection) {
  const OrganisedCloud cloud = Claimed(kBeforeACorner, {0.05, -0.04, 0.02});
  const PoseCorrection first = WallMatcher(*WalledRoomGrid()).Match(cloud, Prior(0.08, 0.04));
  const WallMatcher matcher(*WalledRoomGrid());
  matcher.Match(Claimed(kBeforeAWall, {0.01, 0.02, 0.01}), Prior(0.05, 0.02));
  const PoseCorrection second = matcher.Match(cloud, Prior(0.08, 0.04));
  EXPECT_EQ(first.motion, second.motion);
  EXPECT_EQ(first.covariance, second.covariance);
}

// The first prior is fully correlated, and the second is no covariance.
TEST(WallMatcherTest, PriorThatIsNoProperCovarianceMovesNothing) {
  const WallMatcher matcher(*WalledRoomGrid());
  const OrganisedCloud cloud = Claimed(kBeforeACorner, {0.05, -0.04, 0.02});
  Eigen::Matrix3d priors[2] = {Prior(0.1, 0.1), Prior(0.1, 0.1)};
  priors[0](0, 1) = priors[0](1, 0) = priors[0](0, 0);
  priors[1](0, 1) = priors[1](1, 0) = 2.0 * priors[1](0, 0);
  for (const Eigen::Matrix3d& prior : priors) {
    const PoseCorrection correction = matcher.Match(cloud, prior);
    EXPECT_EQ(correction.motion, Eigen::Vector3d::Zero()) << prior;
    EXPECT_EQ(correction.covariance, prior);
  }
}

TEST(WallMatcherTest, PointsThatAreNotFiniteAreNoWalls) {
  const WallMatcher matcher(*WalledRoomGrid());
  const Eigen::Vector3d error(0.06, 0, 0);
  for (const float number :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max()}) {
    OrganisedCloud cloud = Claimed(kBeforeACorner, error);
    OrganisedCloud without = cloud;
    for (size_t i = 0; i < cloud.camera.size(); i += 5) {
      cloud.camera[i].x() = number;
      without.camera[i].setZero();
    }
    EXPECT_EQ(matcher.Match(cloud, Prior(0.08, 0.04)).motion,
              matcher.Match(without, Prior(0.08, 0.04)).motion)
        << number;
  }
}

TEST(WallMatcherTest, AnyPriorGivesAFinitePose) {
  const WallMatcher matcher(*WalledRoomGrid());
  const OrganisedCloud cloud = Claimed(kBeforeACorner, {0.06, 0, 0});
  for (const double xy_m : {1e-160, 1e-150, 1e-30, 1e6}) {
    for (const double yaw_rad : {1e-160, 1e-150, 1e-30, 1e6}) {
      const PoseCorrection correction = matcher.Match(cloud, Prior(xy_m, yaw_rad));
      EXPECT_TRUE(correction.motion.allFinite()) << xy_m << " " << yaw_rad;
      EXPECT_TRUE(correction.covariance.allFinite()) << xy_m << " " << yaw_rad;
    }
  }
}

}  // namespace
}  // namespace hypermap::ingest
