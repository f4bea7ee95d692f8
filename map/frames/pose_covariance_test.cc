#include "map/frames/pose_covariance.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/not_finite.h"

namespace hypermap {
namespace {

TEST(PoseCovarianceTest, IsFiniteSymmetricAndNotNegative) {
  Eigen::Matrix3d covariance;
  covariance << 0.04, 0.01, 0, 0.01, 0.09, 0, 0, 0, 0.001;
  EXPECT_TRUE(IsPoseCovariance(covariance));
  EXPECT_TRUE(IsPoseCovariance(Eigen::Matrix3d::Zero()));
  Eigen::Matrix3d wrong = covariance;
  wrong(0, 1) = 0.02;
  EXPECT_FALSE(IsPoseCovariance(wrong));
  wrong = covariance;
  wrong(2, 2) = -1e-9;
  EXPECT_FALSE(IsPoseCovariance(wrong));
  wrong = covariance;
  wrong(1, 1) = hypermap::testing::kInf;
  EXPECT_FALSE(IsPoseCovariance(wrong));
  wrong(1, 1) = hypermap::testing::kNan;
  EXPECT_FALSE(IsPoseCovariance(wrong));
}

TEST(PoseCovarianceTest, TurnsWithTheFrame) {
  const Eigen::Matrix3d along_x = Eigen::Vector3d(0.04, 0.01, 0.001).asDiagonal();
  const Eigen::Matrix3d along_y = Eigen::Vector3d(0.01, 0.04, 0.001).asDiagonal();
  const PlanarTransform quarter(10, 20, std::numbers::pi / 2);
  EXPECT_TRUE(TransformedCovariance(along_x, quarter).isApprox(along_y, 1e-12));
}

}  // namespace
}  // namespace hypermap
