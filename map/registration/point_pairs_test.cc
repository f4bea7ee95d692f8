#include "map/registration/point_pairs.h"

#include <cmath>
#include <random>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::registration {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::Uniform;
using ::testing::HasSubstr;

const PlanarTransform kTrueOfPairs(130.0, -40.0, 2.5);

// Returns pairs at random places within 10 m of (50, 20), with errors of their standard deviation.
std::vector<PointPair> RandomPairs(Rng& rng, int number, double sigma_m) {
  std::normal_distribution<double> error(0.0, sigma_m);
  std::vector<PointPair> pairs;
  for (int i = 0; i < number; ++i) {
    PointPair pair;
    pair.source = {50.0 + Uniform(rng, -10.0, 10.0), 20.0 + Uniform(rng, -10.0, 10.0)};
    pair.target = kTrueOfPairs * pair.source;
    pair.target.x += error(rng);
    pair.target.y += error(rng);
    pair.sigma_m = sigma_m;
    pairs.push_back(pair);
  }
  return pairs;
}

Eigen::Vector3d ErrorOf(const PlanarTransform& found) {
  return {found.x() - kTrueOfPairs.x(), found.y() - kTrueOfPairs.y(),
          std::remainder(found.yaw() - kTrueOfPairs.yaw(), 2.0 * M_PI)};
}

TEST(FitPairsTest, ExactPairsGiveTheExactTransform) {
  Rng rng(5);
  const RigidFit fit = FitPairs(RandomPairs(rng, 4, 1e-12));
  EXPECT_LT(ErrorOf(fit.target_from_source).norm(), 1e-9);
}

TEST(FitPairsTest, PairsCountByTheirStandardDeviation) {
  // Two exact pairs say that there is no motion, and two vague ones that there is one of 1 m.
  std::vector<PointPair> pairs = {{{0, 0}, {0, 0}, 0.01},
                                  {{10, 0}, {10, 0}, 0.01},
                                  {{0, 5}, {1, 5}, 1.0},
                                  {{10, 5}, {11, 5}, 1.0}};
  const RigidFit fit = FitPairs(pairs);
  EXPECT_NEAR(fit.target_from_source.x(), 0.0, 0.001);
  EXPECT_NEAR(fit.target_from_source.yaw(), 0.0, 0.001);
}

// Of errors that have the covariance that is told, the square in its units is 3 on average, and the
// sum of squares of the residuals 2 n - 3.
TEST(FitPairsTest, CovarianceIsThatOfTheErrors) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  constexpr int kTrials = 2000;
  double squares = 0.0;
  double chi_squared = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const RigidFit fit = FitPairs(RandomPairs(rng, 30, 0.05));
    const Eigen::Vector3d error = ErrorOf(fit.target_from_source);
    squares += error.dot(fit.covariance.inverse() * error) / kTrials;
    chi_squared += fit.chi_squared / kTrials;
  }
  // Less than 3, since the covariance is never scaled down.
  EXPECT_NEAR(squares, 2.85, 0.3);
  EXPECT_NEAR(chi_squared, 57.0, 2.0);
}

TEST(EstimateFromPairsTest, WrongPairsAreFound) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<PointPair> pairs = RandomPairs(rng, 12, 0.02);
    for (int i = 0; i < 4; ++i) {
      pairs[2 * i].target = {Uniform(rng, -100.0, 100.0), Uniform(rng, -100.0, 100.0)};
    }
    const auto estimate = EstimateFromPairs(pairs);
    ASSERT_TRUE(estimate.ok()) << estimate.status();
    EXPECT_EQ(estimate->ambiguity, Ambiguity::kNone);
    const Eigen::Vector3d error = ErrorOf(estimate->best.target_from_source);
    EXPECT_LT(std::abs(error.z()), 0.01);
    // Five standard deviations, in any direction.
    EXPECT_LT(error.dot(estimate->covariance.inverse() * error), 25.0);
    // A right pair may lie beyond its tolerance by chance.
    EXPECT_LE(estimate->inlier_share, 8.0 / 12.0 + 1e-9);
    EXPECT_GE(estimate->inlier_share, 6.0 / 12.0);
    for (const AgreeingPair& pair : estimate->agreeing) {
      EXPECT_EQ(pair.source, pair.target);
      // Those that were made wrong are not among them.
      EXPECT_TRUE(pair.source % 2 == 1 || pair.source >= 8) << pair.source;
      EXPECT_LT(pair.residual_m, 3.0 * 0.02);
    }
  }
}

TEST(EstimateFromPairsTest, TwoPairsAreEnoughIfTheirDistancesAgree) {
  const auto agree =
      EstimateFromPairs(std::vector<PointPair>{{{0, 0}, {5, 5}, 0.05}, {{4, 0}, {5, 9}, 0.05}});
  ASSERT_TRUE(agree.ok()) << agree.status();
  EXPECT_EQ(agree->ambiguity, Ambiguity::kNone);
  EXPECT_NEAR(agree->best.target_from_source.yaw(), M_PI / 2, 1e-9);
  EXPECT_EQ(agree->inlier_share, 1.0);
  ASSERT_EQ(agree->agreeing.size(), 2u);
  EXPECT_EQ(agree->agreeing[1].source, 1);
  EXPECT_EQ(agree->agreeing[1].target, 1);
  EXPECT_EQ(agree->runner_up, std::nullopt);
  const auto differ =
      EstimateFromPairs(std::vector<PointPair>{{{0, 0}, {5, 5}, 0.05}, {{4, 0}, {5, 10}, 0.05}});
  ASSERT_TRUE(differ.ok()) << differ.status();
  EXPECT_EQ(differ->ambiguity, Ambiguity::kLittleAgreement);
}

TEST(EstimateFromPairsTest, TwoHalvesThatDisagreeAreAmbiguous) {
  Rng rng(9);
  std::vector<PointPair> pairs = RandomPairs(rng, 11, 0.02);
  for (int i = 0; i < 5; ++i) pairs[i].target.x += 3.0;
  const auto estimate = EstimateFromPairs(pairs);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kRunnerUp);
  ASSERT_NE(estimate->runner_up, std::nullopt);
  EXPECT_NEAR(estimate->runner_up->target_from_source.x() - estimate->best.target_from_source.x(),
              3.0, 0.2);
}

TEST(EstimateFromPairsTest, PairsAtOnePlaceTellNoYaw) {
  const auto estimate = EstimateFromPairs(std::vector<PointPair>{
      {{1, 1}, {5, 5}, 0.05}, {{1, 1}, {5, 5}, 0.05}, {{1.01, 1}, {5, 5.01}, 0.05}});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kLittleAgreement);
}

TEST(EstimateFromPairsTest, WrongPairsAreNamed) {
  const auto status = [](std::vector<PointPair> pairs) {
    return EstimateFromPairs(pairs).status();
  };
  const PointPair good{{0, 0}, {1, 1}, 0.05};
  EXPECT_EQ(status({good}).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status({good, {{NAN, 0}, {1, 1}, 0.05}}).message(), HasSubstr("pairs[1]"));
  EXPECT_THAT(status({good, {{0, 0}, {1, 1}, 0.0}}).message(), HasSubstr("pairs[1].sigma_m"));
  EXPECT_EQ(status(std::vector<PointPair>(kMaxPointPairs + 1, good)).code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace hypermap::registration
