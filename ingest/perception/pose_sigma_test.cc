#include "ingest/perception/pose_sigma.h"

#include <gtest/gtest.h>

namespace hypermap::ingest {
namespace {

TEST(PoseSigmaTest, TheCovarianceHasTheSquares) {
  const Eigen::Matrix3d expected = Eigen::Vector3d(0.01, 0.04, 0.09).asDiagonal();
  EXPECT_TRUE((PoseSigma{0.1, 0.2, 0.3}.Covariance().isApprox(expected)));
  EXPECT_EQ((PoseSigma{0.1, 0.2, 0.3}.Covariance()(0, 1)), 0.0);
}

TEST(PoseSigmaTest, ATextIsThreeNumbers) {
  const auto sigma = ParsePoseSigma("0.1, 0,0.3");
  ASSERT_TRUE(sigma.ok()) << sigma.status();
  EXPECT_EQ(*sigma, (PoseSigma{0.1, 0.0, 0.3}));
  for (const char* wrong :
       {"", "1", "1,2", "1,2,3,4", "a,b,c", "-1,0,0", "nan,0,0", "inf,0,0", "0,0,1001"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ParsePoseSigma(wrong).status())) << wrong;
  }
}

TEST(PoseSigmaTest, IsReadAsItWasWritten) {
  EXPECT_EQ(FormatPoseSigma(kLocalisationSigma), "0.06,0.06,0.016");
  for (const PoseSigma& sigma : {kLocalisationSigma, kMotionCaptureSigma}) {
    EXPECT_EQ(*ParsePoseSigma(FormatPoseSigma(sigma)), sigma);
  }
}

}  // namespace
}  // namespace hypermap::ingest
