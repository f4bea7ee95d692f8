#include "map/smoothing/scan_matcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "map/smoothing/testing/rendered_room.h"

namespace hypermap::smoothing {
namespace {

using ::testing::Each;
using ::testing::Gt;

DepthScan ScanFrom(const PlanarTransform& pose) {
  return DepthScan(SeenFrom(FurnishedRoom(), pose, pose, {0.05, 0.05, 0.01}, "r", 0));
}

PlanarPose Motion(const PlanarTransform& from, const PlanarTransform& to) {
  return MotionBetween({from.x(), from.y(), from.yaw()}, {to.x(), to.y(), to.yaw()});
}

TEST(DepthScanTest, PointsLieOnUprightSurfacesAndFaceTheCamera) {
  const PlanarTransform pose(1.0, 0.5, 0.0);  // Before the wall at x = 4.
  const DepthScan scan = ScanFrom(pose);
  ASSERT_GT(scan.surface().size(), 500u);
  for (const SurfacePoint& point : scan.surface()) {
    EXPECT_LT(point.normal.dot(point.position.head<2>()), 0.0f);
    EXPECT_NEAR(point.normal.norm(), 1.0f, 1e-5f);
    EXPECT_GT(point.position.z(), 0.0f);
    const SurfacePoint* const same = scan.SurfaceAt(point.position);
    ASSERT_NE(same, nullptr);
    EXPECT_LT((same->position - point.position).norm(), 0.01f);
  }
  EXPECT_EQ(scan.SurfaceAt({-1.0f, 0.0f, 1.0f}), nullptr);  // Behind the camera.
  EXPECT_EQ(scan.SurfaceAt({1.0f, 20.0f, 1.0f}), nullptr);  // Beside the image.
}

TEST(DepthScanTest, EdgesAreWhereSomethingEndsBeforeWhatIsFarther) {
  // The box in the middle of the room, 0.5 m wide, from 2 m.
  const DepthScan scan = ScanFrom(PlanarTransform(-2.0, 0.05, 0.0));
  int left = 0;
  int right = 0;
  for (const EdgePoint& edge : scan.edges()) {
    if (std::abs(edge.position.x() - 1.7f) > 0.1f) continue;
    (edge.is_right ? right : left)++;
    EXPECT_NEAR(edge.position.y(), edge.is_right ? -0.25f : 0.25f, 0.03f);
    EXPECT_EQ(scan.EdgeNear(edge.position, edge.is_right)->position, edge.position);
  }
  EXPECT_GT(left, 5);
  EXPECT_GT(right, 5);
}

TEST(ScanMatcherTest, FindsTheMotionFromAWrongGuess) {
  const PlanarTransform from(0.5, -0.8, 0.3);
  for (const PlanarTransform& to :
       {PlanarTransform(0.6, -0.75, 0.35), PlanarTransform(0.3, -0.9, 0.1),
        PlanarTransform(1.0, -0.5, 0.5)}) {
    const PlanarPose motion = Motion(from, to);
    const PlanarPose guess = motion + PlanarPose(0.08, -0.06, 0.02);
    const auto match = Match(ScanFrom(from), ScanFrom(to), guess, 0.25);
    ASSERT_TRUE(match.has_value());
    EXPECT_LT((match->motion - motion).head<2>().norm(), 0.01);
    EXPECT_NEAR(match->motion.z(), motion.z(), 0.003);
    EXPECT_THAT((std::vector<double>{match->information(0, 0), match->information(1, 1),
                                     match->information(2, 2)}),
                Each(Gt(1e3)));
  }
}

TEST(ScanMatcherTest, TellsLittleAlongAWall) {
  // Only a bare wall is in view.
  const Room room = {{{{-50.0, -3.0}, {50.0, 3.0}}, 2.5}};
  const auto scan = [&](double x) {
    const PlanarTransform pose(x, 1.0, M_PI / 2);
    return DepthScan(SeenFrom(room, pose, pose, {0.05, 0.05, 0.01}, "r", 0));
  };
  const auto match = Match(scan(0.0), scan(0.1), PlanarPose::Zero(), 0.25);
  ASSERT_TRUE(match.has_value());
  EXPECT_GT(match->information(0, 0), 1e4);  // Across the wall.
  EXPECT_LT(match->information(1, 1), 1e3);  // Along it.
}

TEST(ScanMatcherTest, FramesThatSeeNothingInCommonDoNotMatch) {
  const PlanarTransform from(0.5, -0.8, 0.3);
  const PlanarTransform away(0.5, -0.8, 0.3 + M_PI);
  EXPECT_EQ(Match(ScanFrom(from), ScanFrom(away), Motion(from, away), 0.25), std::nullopt);
  EXPECT_EQ(Overlap(ScanFrom(from), ScanFrom(away), Motion(from, away)), 0.0);
  EXPECT_EQ(Overlap(ScanFrom(from), ScanFrom(from), PlanarPose::Zero()), 1.0);
}

}  // namespace
}  // namespace hypermap::smoothing
