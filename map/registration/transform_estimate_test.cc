#include "map/registration/transform_estimate.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"
#include "map/registration/point_pairs.h"

namespace hypermap::registration {
namespace {

const PlanarTransform kNewTargetFromTarget(4.0, -9.0, 0.7);
const PlanarTransform kNewSourceFromSource(-20.0, 3.0, -1.9);

std::vector<PointPair> Pairs() {
  return {{{1, 2}, {11, 3}, 0.05}, {{5, 2}, {11, 7.1}, 0.1}, {{5, 9}, {4, 7}, 0.02}};
}

// An estimate in other frames is what pairs of points in these frames give.
TEST(InFramesTest, IsTheFitOfThePointsInTheseFrames) {
  const RigidFit before = FitPairs(Pairs());
  std::vector<PointPair> moved = Pairs();
  for (PointPair& pair : moved) {
    pair.source = kNewSourceFromSource * pair.source;
    pair.target = kNewTargetFromTarget * pair.target;
  }
  const RigidFit after = FitPairs(moved);
  TransformEstimate estimate;
  estimate.best = {before.target_from_source, 0.8};
  estimate.covariance = before.covariance;
  estimate.runner_up = Mode{before.target_from_source, 0.3};
  estimate.agreeing = {{1, 1, 0.5}};
  const TransformEstimate found = InFrames(estimate, kNewTargetFromTarget, kNewSourceFromSource);
  for (const PlanarTransform& pose :
       {found.best.target_from_source, found.runner_up->target_from_source}) {
    EXPECT_NEAR(pose.x(), after.target_from_source.x(), 1e-9);
    EXPECT_NEAR(pose.y(), after.target_from_source.y(), 1e-9);
    EXPECT_NEAR(pose.yaw(), after.target_from_source.yaw(), 1e-9);
  }
  EXPECT_TRUE(found.covariance.isApprox(after.covariance, 1e-9)) << found.covariance;
  EXPECT_FALSE(found.covariance.isApprox(before.covariance, 0.01));
  EXPECT_EQ(found.best.score, 0.8);
  EXPECT_EQ(found.agreeing, estimate.agreeing);
}

TEST(InFramesTest, InfiniteCovarianceStaysInfinite) {
  const TransformEstimate found =
      InFrames(TransformEstimate(), kNewTargetFromTarget, kNewSourceFromSource);
  EXPECT_EQ(found.covariance, InfiniteCovariance());
}

}  // namespace
}  // namespace hypermap::registration
